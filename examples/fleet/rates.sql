-- How often is each topic sent, over all bags? Rates are sums of counts over the window's length, never averages of
-- rates; windows at the ends of a bag, which may be cut, are left out.
WITH bags AS (
  SELECT bag, min(win) AS first_win, max(win) AS last_win FROM counts GROUP BY bag
),
windows AS (
  SELECT counts.bag, counts.topic, counts.win,
    sum(counts.n) * CAST(1000000000 AS DOUBLE) / max(counts.period_ns) AS hz
  FROM counts JOIN bags ON counts.bag = bags.bag
  WHERE counts.win > bags.first_win AND counts.win < bags.last_win
  GROUP BY counts.bag, counts.topic, counts.win
)
SELECT topic, count(DISTINCT bag) AS bags, count(*) AS windows,
  min(hz) AS least_hz, avg(hz) AS mean_hz, max(hz) AS most_hz
FROM windows GROUP BY topic
ORDER BY topic
