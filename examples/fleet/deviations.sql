-- Which bags differ from the architecture that most have, and in what? A publication is usual if it is there in more
-- than half of the bags; each bag that lacks one, or has one that is not usual, gets a row.
WITH edges AS (
  SELECT DISTINCT bag, node, topic FROM counts WHERE node IS NOT NULL
),
bags AS (
  SELECT DISTINCT bag FROM edges
),
usual AS (
  SELECT node, topic FROM edges GROUP BY node, topic
  HAVING count(*) * 2 > (SELECT count(*) FROM bags)
),
lacking AS (
  SELECT bags.bag, usual.node, usual.topic, 'lacks' AS what
  FROM bags CROSS JOIN usual
  LEFT JOIN edges
    ON edges.bag = bags.bag AND edges.node = usual.node AND edges.topic = usual.topic
  WHERE edges.bag IS NULL
),
extra AS (
  SELECT edges.bag, edges.node, edges.topic, 'has' AS what
  FROM edges LEFT JOIN usual ON usual.node = edges.node AND usual.topic = edges.topic
  WHERE usual.node IS NULL
)
SELECT bag, what, node, topic FROM lacking
UNION ALL
SELECT bag, what, node, topic FROM extra
ORDER BY bag, what, node, topic
