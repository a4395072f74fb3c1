-- Drift by machine: how far the last accepted value is from the first, and in combined standard uncertainties of both.
-- Results of a box that had no time then are left out.
SELECT machine, subject, key, count(*) AS results, last - first AS drift,
       abs(last - first) / nullif(sqrt(u_first ^ 2 + u_last ^ 2), 0) AS in_u
FROM (SELECT machine, subject, key,
             first_value(value) OVER w AS first, first_value(u) OVER w AS u_first,
             last_value(value) OVER w AS last, last_value(u) OVER w AS u_last
      FROM accepted_value
      WHERE proposed_utc ~ '^[0-9]'
      WINDOW w AS (PARTITION BY machine, subject, key ORDER BY proposed_utc
                   ROWS BETWEEN UNBOUNDED PRECEDING AND UNBOUNDED FOLLOWING)) AS ends
GROUP BY machine, subject, key, first, last, u_first, u_last
HAVING count(*) > 1
ORDER BY in_u DESC NULLS LAST;

-- Overdue: subjects whose last accepted result is older than 180 days.
SELECT machine, subject, max(proposed_utc) AS measured
FROM accepted_value
WHERE proposed_utc ~ '^[0-9]'
GROUP BY machine, subject
HAVING max(proposed_utc) < to_char(now() AT TIME ZONE 'UTC' - interval '180 days', 'YYYY-MM-DD"T"HH24:MI:SS"Z"')
ORDER BY measured;

-- Worst probes: how many of their runs were refused, and how uncertain their delays are, in s.
SELECT probe, count(*) AS runs, avg((document ? 'refusal')::int) AS refused,
       (SELECT avg(v.u) FROM result_value v WHERE v.probe = r.probe AND v.key LIKE 'tau%') AS mean_u_of_delays_s
FROM result r
GROUP BY probe
ORDER BY refused DESC, mean_u_of_delays_s DESC NULLS LAST;
