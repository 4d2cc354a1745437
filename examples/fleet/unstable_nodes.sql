-- Which nodes come late, end early or are away in between, and in how many missions?
-- Windows are compared with those of the mission; one window of slack at either end.
WITH missions AS (
  SELECT mission, min(win) AS first_win, max(win) AS last_win FROM counts GROUP BY mission
),
nodes AS (
  SELECT mission, node, min(win) AS first_win, max(win) AS last_win, count(DISTINCT win) AS wins
  FROM counts WHERE node IS NOT NULL GROUP BY mission, node
),
judged AS (
  SELECT nodes.node,
    CASE WHEN nodes.first_win > missions.first_win + 1 THEN 1 ELSE 0 END AS is_late,
    CASE WHEN nodes.last_win < missions.last_win - 1 THEN 1 ELSE 0 END AS is_early,
    CASE WHEN nodes.wins < nodes.last_win - nodes.first_win + 1 THEN 1 ELSE 0 END AS is_away
  FROM nodes JOIN missions ON nodes.mission = missions.mission
)
SELECT node, count(*) AS missions, sum(is_late) AS late, sum(is_early) AS ended_early, sum(is_away) AS away
FROM judged GROUP BY node
HAVING sum(is_late) + sum(is_early) + sum(is_away) > 0
ORDER BY node
