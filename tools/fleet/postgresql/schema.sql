-- Results and histories of many boxes, as probebox-fleet publishes them. The whole document is kept; what queries need is drawn from
-- it. A message that comes twice finds its row: the key has the time beside the number, which begins at 1 in a store made anew.
CREATE TABLE IF NOT EXISTS result (
  document jsonb NOT NULL,
  serial_number text GENERATED ALWAYS AS (document->>'serial_number') STORED NOT NULL,
  id bigint GENERATED ALWAYS AS ((document->>'id')::bigint) STORED NOT NULL,
  proposed_utc text GENERATED ALWAYS AS (document->'history'->0->>'utc') STORED NOT NULL,
  subject text GENERATED ALWAYS AS (document->>'subject') STORED,
  method text GENERATED ALWAYS AS (document->>'method') STORED,
  machine text GENERATED ALWAYS AS (document->>'machine') STORED,
  probe text GENERATED ALWAYS AS (document->>'probe') STORED,
  arrived timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (serial_number, id, proposed_utc)
);

CREATE TABLE IF NOT EXISTS history (
  document jsonb NOT NULL,
  serial_number text GENERATED ALWAYS AS (document->>'serial_number') STORED NOT NULL,
  number bigint GENERATED ALWAYS AS ((document->>'number')::bigint) STORED NOT NULL,
  utc text GENERATED ALWAYS AS (document->>'utc') STORED NOT NULL,
  result_id bigint GENERATED ALWAYS AS ((document->>'id')::bigint) STORED,
  subject text GENERATED ALWAYS AS (document->>'subject') STORED,
  state text GENERATED ALWAYS AS (document->>'state') STORED,
  arrived timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (serial_number, number, utc)
);

-- The newest state of each box.
CREATE TABLE IF NOT EXISTS box (
  serial_number text PRIMARY KEY,
  document jsonb NOT NULL,
  arrived timestamptz NOT NULL DEFAULT now()
);

-- A row for each value of each result, with its combined standard uncertainty (k = 1), both in the unit that the key ends with.
CREATE OR REPLACE VIEW result_value AS
  SELECT serial_number, id, proposed_utc, subject, method, machine, probe, value.key, value.value::float8 AS value,
         (document->'u'->>value.key)::float8 AS u
  FROM result, jsonb_each_text(document->'result') AS value;

-- Results that have ever come into force. A store made anew counts from 1 again: an entry is about the last result of its number
-- that was there before it. Where a box had no time, it says "unknown, 12 s after start 7".
CREATE OR REPLACE VIEW accepted_value AS
  SELECT v.* FROM result_value v
  WHERE EXISTS (SELECT FROM history h WHERE h.serial_number = v.serial_number AND h.result_id = v.id AND h.state = 'active'
                  AND (h.utc >= v.proposed_utc OR v.proposed_utc !~ '^[0-9]')
                  AND NOT EXISTS (SELECT FROM result r WHERE r.serial_number = v.serial_number AND r.id = v.id
                                  AND r.proposed_utc > v.proposed_utc AND r.proposed_utc <= h.utc));
