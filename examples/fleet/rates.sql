-- How often is each topic sent, over all missions? Rates are sums of counts over the window's length, never averages of
-- rates; windows at the ends of a mission, which may be cut, are left out.
WITH missions AS (
  SELECT mission, min(win) AS first_win, max(win) AS last_win FROM counts GROUP BY mission
),
windows AS (
  SELECT counts.mission, counts.topic, counts.win,
    sum(counts.n) * CAST(1000000000 AS DOUBLE) / max(counts.period_ns) AS hz
  FROM counts JOIN missions ON counts.mission = missions.mission
  WHERE counts.win > missions.first_win AND counts.win < missions.last_win
  GROUP BY counts.mission, counts.topic, counts.win
)
SELECT topic, count(DISTINCT mission) AS missions, count(*) AS windows,
  min(hz) AS least_hz, avg(hz) AS mean_hz, max(hz) AS most_hz
FROM windows GROUP BY topic
ORDER BY topic
