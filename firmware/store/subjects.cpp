#include "firmware/store/rows.hpp"
#include "firmware/store/schema.hpp"

// Earlier versions had one subject for the turning axis relative to the spindle axis and relative to the stylus' tip,
// and for a delay by axis and by joint; and two subjects for one pivot or one offset of the spindle.
namespace probebox::store {
namespace {

// A centreline with a stylus offset in it says so in its own row.
constexpr const char* kRename = R"sql(
  CREATE TEMP TABLE renamed AS SELECT id, state, method, subject AS was, CASE
      WHEN subject = 'centreline' AND method = 'c-axis-alignment' AND instr(result_json, '"Z_slide_rad"') > 0
        THEN CASE WHEN instr(result_json, 'the spindle stood still') > 0 THEN method ELSE 'centreline-slide' END
      WHEN subject = 'centreline' AND instr(result_json, '"stylus_offset_in_force_mm"') = 0
        AND (method IN ('centreline', 'centreline-limited-access')
          OR (method = 'c-axis-alignment' AND instr(result_json, 'the spindle stood still') > 0)
          OR (method = 'centreline-by-steps'
            AND instr(result_json, '"key":"stylus_offset_mm","shape":1,"columns":1,"values":[0.0,0.0') > 0))
        THEN 'centreline-stylus'
      WHEN subject = 'delay' AND instr(result_json, '"tau_joint_s"') > 0 THEN 'delay-joints'
      WHEN subject IN ('spindle-offset-four', 'spindle-offset-2x2') THEN 'spindle-offset'
      WHEN subject = 'a-axis-alignment' THEN 'spindle-tilt'
      WHEN subject IN ('head-pivot-3d', 'table-pivot-3d') THEN replace(subject, '-3d', '')
      WHEN subject = 'periodic-check' THEN 'check'
      ELSE subject END AS subject
    FROM results WHERE state < 5;
  DELETE FROM temp.renamed WHERE subject = was;
  DROP INDEX one_active_result;
  DROP INDEX one_waiting_result;
  UPDATE results SET subject = (SELECT n.subject FROM temp.renamed n WHERE n.id = results.id)
    WHERE id IN (SELECT id FROM temp.renamed);
)sql";

// Where two results in force (or waiting) are now about one subject, the one accepted last stays.
constexpr const char* kReplace = R"sql(
  CREATE TEMP TABLE replaced AS SELECT older.id AS id, max(newer.accepted_utc) AS utc
    FROM results older JOIN results newer
      ON older.state = newer.state AND older.state IN (1, 2) AND newer.subject = older.subject
      AND newer.probe = older.probe AND newer.machine = older.machine AND newer.mounting = older.mounting
      AND (newer.accepted_utc, newer.id) > (older.accepted_utc, older.id)
    GROUP BY older.id;
  INSERT INTO transitions (result_id, state, utc, by_whom) SELECT id, 3, utc, '' FROM temp.replaced ORDER BY id;
  UPDATE transitions SET checksum = row_sum(id, result_id, state, utc, by_whom)
    WHERE id > (SELECT max(id) FROM transitions) - (SELECT count(*) FROM temp.replaced);
  UPDATE results SET state = 3, retired_utc = (SELECT utc FROM temp.replaced o WHERE o.id = results.id)
    WHERE id IN (SELECT id FROM temp.replaced);
  UPDATE results SET checksum = row_sum(id, state, method, subject, probe, machine, mounting, result_json,
      proposed_utc, accepted_utc, accepted_by, retired_utc)
    WHERE id IN (SELECT id FROM temp.renamed) OR id IN (SELECT id FROM temp.replaced);
  CREATE UNIQUE INDEX one_active_result ON results (subject, probe, machine, mounting) WHERE state = 2;
  CREATE UNIQUE INDEX one_waiting_result ON results (subject, probe, machine, mounting) WHERE state = 1;
)sql";

constexpr const char* kTold =
    "SELECT coalesce(group_concat('result ' || id || ' of ' || method || ' is about ' || subject || ' now, not ' || "
    "was, "
    "'; '), '') FROM (SELECT * FROM temp.renamed WHERE state IN (1, 2) AND was IN ('centreline', 'delay') ORDER BY id)";

}  // namespace

Outcome<std::string, Failure> assignSubjects(Database& database) {
  // Damaged rows are out of the way of those that are whole, and are not sealed again.
  TRY(markDamaged(database));
  TRY(database.run(kRename));
  TRY(database.run(kReplace));
  auto told = database.text(kTold);
  if (!told) return told;
  if (const auto done = database.run("DROP TABLE temp.renamed; DROP TABLE temp.replaced"); !done) return done.error();
  if (told->empty()) return told;
  return "One subject stands for one quantity since this version: " + *told +
         ". What was served from them is not served any more: see `probebox history`, and measure the stylus offset "
         "(spindle-offset-2x2) for a centreline from the stylus' tip.";
}

}  // namespace probebox::store
