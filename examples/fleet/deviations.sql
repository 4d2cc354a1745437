-- Which missions differ from the architecture that most have, and in what? A publication is usual if it is there in more
-- than half of the missions; each mission that lacks one, or has one that is not usual, gets a row.
WITH edges AS (
  SELECT DISTINCT mission, node, topic FROM counts WHERE node IS NOT NULL
),
missions AS (
  SELECT DISTINCT mission FROM edges
),
usual AS (
  SELECT node, topic FROM edges GROUP BY node, topic
  HAVING count(*) * 2 > (SELECT count(*) FROM missions)
),
lacking AS (
  SELECT missions.mission, usual.node, usual.topic, 'lacks' AS what
  FROM missions CROSS JOIN usual
  LEFT JOIN edges
    ON edges.mission = missions.mission AND edges.node = usual.node AND edges.topic = usual.topic
  WHERE edges.mission IS NULL
),
extra AS (
  SELECT edges.mission, edges.node, edges.topic, 'has' AS what
  FROM edges LEFT JOIN usual ON usual.node = edges.node AND usual.topic = edges.topic
  WHERE usual.node IS NULL
)
SELECT mission, what, node, topic FROM lacking
UNION ALL
SELECT mission, what, node, topic FROM extra
ORDER BY mission, what, node, topic
