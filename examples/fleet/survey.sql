-- What is in the fleet? A row per format, and one for what could not be read.
SELECT coalesce(format, 'unreadable') AS format, count(*) AS bags,
  sum(CASE WHEN error IS NULL AND messages = 0 THEN 1 ELSE 0 END) AS without_messages,
  sum(CASE WHEN error IS NULL AND NOT is_complete THEN 1 ELSE 0 END) AS damaged,
  count(DISTINCT mission) AS missions, sum(messages) AS messages
FROM bags GROUP BY coalesce(format, 'unreadable')
ORDER BY format
