-- Results and histories of many boxes, as probebox-fleet publishes them. The whole document is kept; what queries need is drawn from
-- it. A message that comes twice finds its row: the key has the time beside the number, which begins at 1 in a store made anew.
-- Rows are numbered as they arrive, in the order in which a box published them: its clock may step back, or be unknown.
CREATE SEQUENCE IF NOT EXISTS arrival;

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
  arrival bigint NOT NULL DEFAULT nextval('arrival'),
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
  arrival bigint NOT NULL DEFAULT nextval('arrival'),
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
  SELECT serial_number, id, proposed_utc, subject, method, machine, probe, arrival, value.key, value.value::float8 AS value,
         (document->'u'->>value.key)::float8 AS u
  FROM result, jsonb_each_text(document->'result') AS value;

-- Results that have ever come into force. A store made anew counts from 1 again: an entry is about the last result of its number
-- that had arrived before it.
CREATE OR REPLACE VIEW accepted_value AS
  SELECT v.* FROM result_value v
  WHERE EXISTS (SELECT FROM history h WHERE h.serial_number = v.serial_number AND h.result_id = v.id AND h.state = 'active'
                  AND v.arrival = (SELECT max(r.arrival) FROM result r WHERE r.serial_number = h.serial_number
                                     AND r.id = h.result_id AND r.arrival < h.arrival));
