-- When does each publication first come back after a silence of a whole window, and in which mission?
WITH steps AS (
  SELECT mission, topic, coalesce(node, '') AS node, win, start_ns,
    lag(win) OVER (PARTITION BY mission, topic, coalesce(node, '') ORDER BY win) AS win_before
  FROM (
    SELECT mission, topic, node, win, min(start_ns) AS start_ns
    FROM counts GROUP BY mission, topic, node, win
  ) AS windows
),
returns AS (
  SELECT mission, topic, node, start_ns, win - win_before - 1 AS silent_windows,
    row_number() OVER (PARTITION BY topic, node ORDER BY start_ns, mission) AS place
  FROM steps WHERE win > win_before + 1
)
SELECT topic, node, mission, start_ns, silent_windows
FROM returns WHERE place = 1
ORDER BY topic, node
