"""Validates check reports against the published schemas of their formats; run by hand, since both schemas are third-party files.

Usage: validate.py JUNIT.xsd SARIF.json CHECK.xml CHECK.sarif QUALITY.json

pip: jsonschema, junitparser, xmlschema. The schemas: `junit-10.xsd` of github.com/jenkinsci/xunit-plugin, and
`sarif-schema-2.1.0.json` of github.com/oasis-tcs/sarif-spec. For GitLab's code quality there is a table in its manual.
"""

import json
import sys

import jsonschema
import junitparser
import xmlschema

ISSUE = {
    "type": "object",
    "required": ["description", "check_name", "fingerprint", "severity", "location"],
    "properties": {
        "description": {"type": "string", "minLength": 1},
        "check_name": {"type": "string", "minLength": 1},
        "fingerprint": {"type": "string", "pattern": "^[0-9a-f]{12}$"},
        "severity": {"enum": ["info", "minor", "major", "critical", "blocker"]},
        "location": {
            "type": "object",
            "required": ["path", "lines"],
            "properties": {
                "path": {"type": "string", "pattern": "^(?!\\./|/)"},
                "lines": {
                    "type": "object",
                    "required": ["begin"],
                    "properties": {"begin": {"type": "integer", "minimum": 1}},
                },
            },
        },
    },
}


def junit(schema, path):
    xmlschema.XMLSchema(schema).validate(path)
    suites = list(junitparser.JUnitXml.fromfile(path))
    cases = [case for suite in suites for case in suite]
    of = lambda kind: sum(any(isinstance(r, kind) for r in case.result) for case in cases)
    counted = (len(cases), of(junitparser.Failure), of(junitparser.Skipped))
    reported = (suites[0].tests, suites[0].failures, suites[0].skipped)
    assert counted == reported, f"counted {counted} cases, failures, skipped; the file reports {reported}"
    assert len({(c.classname, c.name) for c in cases}) == len(cases), "two cases of one name"
    return counted


def sarif(schema, path):
    with open(schema) as file:
        schema = json.load(file)
    with open(path) as file:
        report = json.load(file)
    jsonschema.validators.validator_for(schema)(schema).validate(report)
    results = report["runs"][0]["results"]
    for result in results:
        place = result["locations"][0]["physicalLocation"]
        assert place["artifactLocation"]["uri"] and place["region"]["startLine"] >= 1
    return len(results)


def gitlab(path):
    with open(path) as file:
        issues = json.load(file)
    jsonschema.validate(issues, {"type": "array", "items": ISSUE})
    assert len({issue["fingerprint"] for issue in issues}) == len(issues), "two of one fingerprint"
    return len(issues)


if __name__ == "__main__":
    if len(sys.argv) != 6:
        sys.exit(__doc__)
    xsd, schema, check_xml, check_sarif, quality = sys.argv[1:]
    cases, failures, skipped = junit(xsd, check_xml)
    print(f"JUnit: {cases} cases, {failures} failures, {skipped} skipped")
    print(f"SARIF: {sarif(schema, check_sarif)} results")
    print(f"GitLab: {gitlab(quality)} issues")
