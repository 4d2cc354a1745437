-- When does each publication first come back after a silence of a whole window, and in which bag?
WITH steps AS (
  SELECT bag, topic, coalesce(node, '') AS node, win, start_ns,
    lag(win) OVER (PARTITION BY bag, topic, coalesce(node, '') ORDER BY win) AS win_before
  FROM (
    SELECT bag, topic, node, win, min(start_ns) AS start_ns
    FROM counts GROUP BY bag, topic, node, win
  ) AS windows
),
returns AS (
  SELECT bag, topic, node, start_ns, win - win_before - 1 AS silent_windows,
    row_number() OVER (PARTITION BY topic, node ORDER BY start_ns, bag) AS place
  FROM steps WHERE win > win_before + 1
)
SELECT topic, node, bag, start_ns, silent_windows
FROM returns WHERE place = 1
ORDER BY topic, node
