-- Which nodes come late, end early or are away in between, and in how many bags?
-- Windows are compared with those of the bag; one window of slack at either end.
WITH bags AS (
  SELECT bag, min(win) AS first_win, max(win) AS last_win FROM counts GROUP BY bag
),
nodes AS (
  SELECT bag, node, min(win) AS first_win, max(win) AS last_win, count(DISTINCT win) AS wins
  FROM counts WHERE node IS NOT NULL GROUP BY bag, node
),
judged AS (
  SELECT nodes.node,
    CASE WHEN nodes.first_win > bags.first_win + 1 THEN 1 ELSE 0 END AS is_late,
    CASE WHEN nodes.last_win < bags.last_win - 1 THEN 1 ELSE 0 END AS is_early,
    CASE WHEN nodes.wins < nodes.last_win - nodes.first_win + 1 THEN 1 ELSE 0 END AS is_away
  FROM nodes JOIN bags ON nodes.bag = bags.bag
)
SELECT node, count(*) AS bags, sum(is_late) AS late, sum(is_early) AS ended_early, sum(is_away) AS away
FROM judged GROUP BY node
HAVING sum(is_late) + sum(is_early) + sum(is_away) > 0
ORDER BY node
