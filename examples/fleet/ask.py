"""Runs the questions over a folder of tables on every engine that is installed, and compares the answers.

Usage: python ask.py FOLDER. Engines: duckdb, datafusion, pyspark (any of them; pip).
"""

import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
TABLES = ("counts", "bags")


def duckdb(folder):
    import duckdb as engine

    db = engine.connect()
    for table in TABLES:
        db.execute(f"CREATE TABLE {table} AS FROM '{folder}/{table}/*.parquet'")
    return lambda text: db.execute(text).fetchall()


def datafusion(folder):
    from datafusion import SessionContext

    context = SessionContext()
    for table in TABLES:
        context.register_parquet(table, f"{folder}/{table}/")
        context.from_arrow(context.table(table).to_arrow_table(), f"{table}_held")
        context.deregister_table(table)
        context.from_arrow(context.table(f"{table}_held").to_arrow_table(), table)
    return lambda text: [tuple(row.values()) for row in context.sql(text).to_arrow_table().to_pylist()]


def spark(folder):
    from pyspark.sql import SparkSession

    quiet = {"spark.ui.enabled": "false", "spark.ui.showConsoleProgress": "false"}
    session = SparkSession.builder.master("local[2]").config(map=quiet).getOrCreate()
    session.sparkContext.setLogLevel("ERROR")
    for table in TABLES:
        session.read.parquet(f"{folder}/{table}").cache().createOrReplaceTempView(table)
        session.table(table).count()
    return lambda text: [tuple(row) for row in session.sql(text).collect()]


def plain(rows):
    """Rows as they compare: means differ in their last digits."""
    return [tuple(round(cell, 6) if isinstance(cell, float) else cell for cell in row) for row in rows]


def main():
    folder = Path(sys.argv[1]).resolve()
    engines = {}
    for make in (duckdb, datafusion, spark):
        try:
            started = time.perf_counter()
            engines[make.__name__] = make(folder)
            print(f"{make.__name__}: loaded in {time.perf_counter() - started:.2f} s")
        except ImportError:
            print(f"{make.__name__}: not installed")
    differ = False
    for question in sorted(HERE.glob("*.sql")):
        answers = {}
        for name, ask in engines.items():
            started = time.perf_counter()
            answers[name] = plain(ask(question.read_text()))
            print(f"{question.stem}: {name} {len(answers[name])} rows in {time.perf_counter() - started:.2f} s")
        if len({tuple(rows) for rows in answers.values()}) > 1:
            differ = True
            print(f"{question.stem}: THE ANSWERS DIFFER")
    sys.exit(1 if differ else 0)


if __name__ == "__main__":
    main()
