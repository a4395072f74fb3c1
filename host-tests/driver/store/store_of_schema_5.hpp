#pragma once

// A store as schema 5 wrote it, as text: the dump (sqlite3 results.db .dump, with its application_id and user_version in
// front) of a file that the store of commit 5a7f204 made, in this order of proposals:
//   1 delay-multi-speed, in force; 2 c-axis-alignment, retired by 3; 3 centreline-limited-access, in force;
//   4 centreline; 5 centreline-by-steps with a stylus offset, waiting; 6 c-axis-alignment with heights = slide;
//   7 c-axis-alignment, the spindle stood still; 8 centreline-by-steps without a stylus offset; 9 spindle-offset-four,
//   10 spindle-offset-2x2, 11 head-pivot, 12 head-pivot-3d, 13 periodic-check, all in force; 14 a refusal of centreline;
//   15 delay-joints by joint; 16 centreline of the mounting "bench", in force.
namespace probebox::store {

inline constexpr const char* kSchema5 = R"sql(
PRAGMA application_id = 1885499256;
PRAGMA user_version = 5;
PRAGMA foreign_keys=OFF;
BEGIN TRANSACTION;
CREATE TABLE results (
        id INTEGER PRIMARY KEY AUTOINCREMENT,  -- never given twice, also not after a deletion
        state INTEGER NOT NULL,
        method TEXT NOT NULL,
        probe TEXT NOT NULL,
        machine TEXT NOT NULL,
        mounting TEXT NOT NULL,
        result_json TEXT NOT NULL,
        proposed_utc TEXT NOT NULL,
        accepted_utc TEXT NOT NULL DEFAULT '',
        accepted_by TEXT NOT NULL DEFAULT '',
        retired_utc TEXT NOT NULL DEFAULT ''
      , subject TEXT NOT NULL DEFAULT '', checksum INTEGER NOT NULL DEFAULT 0) STRICT;
INSERT INTO results VALUES(1,2,'delay-multi-speed','P-1001','mill 3','spindle','{"method":"delay-multi-speed","estimates":[{"key":"tau_s","shape":0,"columns":1,"values":[0.00385],"sd":[4e-06],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:00:00Z','2026-11-22T10:01:00Z','Ada','','delay',1443138893);
INSERT INTO results VALUES(2,3,'c-axis-alignment','P-1001','mill 3','spindle','{"method":"c-axis-alignment","estimates":[{"key":"C_tilt_rad","shape":1,"columns":1,"values":[0.0002,-0.00015],"sd":[1e-06,1e-06],"design":[],"uncertainty":[]}],"also":[{"key":"centre_mm","shape":1,"columns":1,"values":[0.154,-0.1103],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]},{"key":"mean_z_mm","shape":0,"columns":1,"values":[155.0],"sd":[],"design":[],"uncertainty":[]}],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:02:00Z','2026-11-22T10:03:00Z','Ada','2026-11-22T10:05:00Z','centreline',435200080);
INSERT INTO results VALUES(3,2,'centreline-limited-access','P-1001','mill 3','spindle','{"method":"centreline-limited-access","estimates":[{"key":"centre_mm","shape":1,"columns":1,"values":[0.174,-0.1233],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:04:00Z','2026-11-22T10:05:00Z','Ada','','centreline',581496513);
INSERT INTO results VALUES(4,0,'centreline','P-1001','mill 3','spindle','{"method":"centreline","estimates":[{"key":"centre_mm","shape":1,"columns":1,"values":[0.175,-0.123],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:06:00Z','','','','centreline',840399749);
INSERT INTO results VALUES(5,1,'centreline-by-steps','P-1001','mill 3','spindle','{"method":"centreline-by-steps","estimates":[{"key":"centre_mm","shape":1,"columns":1,"values":[0.154,-0.1104],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]}],"also":[{"key":"stylus_offset_mm","shape":1,"columns":1,"values":[0.02,-0.013],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]}],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:07:00Z','2026-11-22T10:08:00Z','Ada','','centreline',3215518811);
INSERT INTO results VALUES(6,0,'c-axis-alignment','P-1001','mill 3','spindle','{"method":"c-axis-alignment","estimates":[{"key":"Z_slide_rad","shape":1,"columns":1,"values":[0.0003,-0.0002],"sd":[1e-06,1e-06],"design":[],"uncertainty":[]}],"also":[{"key":"centre_mm","shape":1,"columns":1,"values":[0.16,-0.12],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]},{"key":"mean_z_mm","shape":0,"columns":1,"values":[200.0],"sd":[],"design":[],"uncertainty":[]}],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:09:00Z','','','','centreline',2260939740);
INSERT INTO results VALUES(7,0,'c-axis-alignment','P-1001','mill 3','spindle','{"method":"c-axis-alignment","estimates":[{"key":"C_tilt_rad","shape":1,"columns":1,"values":[0.0002,-0.00015],"sd":[1e-06,1e-06],"design":[],"uncertainty":[]}],"also":[{"key":"centre_mm","shape":1,"columns":1,"values":[0.174,-0.1234],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]},{"key":"mean_z_mm","shape":0,"columns":1,"values":[155.0],"sd":[],"design":[],"uncertainty":[]}],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":["the spindle stood still: centre_mm is that of the tip, not of the spindle axis; the slope is not affected"],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:10:00Z','','','','centreline',1785234169);
INSERT INTO results VALUES(8,0,'centreline-by-steps','P-1001','mill 3','spindle','{"method":"centreline-by-steps","estimates":[{"key":"centre_mm","shape":1,"columns":1,"values":[0.154,-0.1104],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]}],"also":[{"key":"stylus_offset_mm","shape":1,"columns":1,"values":[0.0,0.0],"sd":[0.0,0.0],"design":[],"uncertainty":[]}],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:11:00Z','','','','centreline',422836770);
INSERT INTO results VALUES(9,2,'spindle-offset-four','P-1001','mill 3','spindle','{"method":"spindle-offset-four","estimates":[{"key":"offset_C_minus_A_mm","shape":1,"columns":1,"values":[0.106,-0.167],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:12:00Z','2026-11-22T10:13:00Z','Ada','','spindle-offset-four',3204265639);
INSERT INTO results VALUES(10,2,'spindle-offset-2x2','P-1001','mill 3','spindle','{"method":"spindle-offset-2x2","estimates":[{"key":"offset_C_minus_A_mm","shape":1,"columns":1,"values":[0.1061,-0.1671],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]},{"key":"stylus_offset_mm","shape":1,"columns":1,"values":[0.02,-0.013],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:14:00Z','2026-11-22T10:15:00Z','Ada','','spindle-offset-2x2',2864980333);
INSERT INTO results VALUES(11,2,'head-pivot','P-1001','mill 3','spindle','{"method":"head-pivot","estimates":[{"key":"pivot_yz_mm","shape":1,"columns":1,"values":[-12.3,45.6],"sd":[0.001,0.001],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:16:00Z','2026-11-22T10:17:00Z','Ada','','head-pivot',465555834);
INSERT INTO results VALUES(12,2,'head-pivot-3d','P-1001','mill 3','spindle','{"method":"head-pivot-3d","estimates":[{"key":"pivot_yz_mm","shape":1,"columns":1,"values":[-12.301,45.601],"sd":[0.001,0.001],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:18:00Z','2026-11-22T10:19:00Z','Ada','','head-pivot-3d',3876810011);
INSERT INTO results VALUES(13,2,'periodic-check','P-1001','mill 3','spindle','{"method":"periodic-check","estimates":[{"key":"Xcen_B0_mm","shape":0,"columns":1,"values":[0.154],"sd":[5e-05],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:20:00Z','2026-11-22T10:21:00Z','Ada','','periodic-check',2841582427);
INSERT INTO results VALUES(14,4,'centreline','P-1001','mill 3','spindle','{"name":"angles-too-close","reason":"turn further"}','2026-11-22T10:22:00Z','','','','centreline',2666812803);
INSERT INTO results VALUES(15,0,'delay-joints','P-1001','mill 3','spindle','{"method":"delay-joints","estimates":[{"key":"tau_joint_s","shape":1,"columns":1,"values":[0.003,0.004],"sd":[4e-06,4e-06],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:23:00Z','','','','delay',2455941223);
INSERT INTO results VALUES(16,2,'centreline','P-1001','mill 3','bench','{"method":"centreline","estimates":[{"key":"centre_mm","shape":1,"columns":1,"values":[0.2,-0.1],"sd":[5e-05,5e-05],"design":[],"uncertainty":[]}],"also":[],"rms":0.0002,"dof":4,"condition":1.5,"convention":"","warnings":[],"dropped":[],"grounds":{"design_per":"","unobservable":[],"budget":[],"conditions":[]}}','2026-11-22T10:24:00Z','2026-11-22T10:25:00Z','Ada','','centreline',2810384919);
CREATE TABLE transitions (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        result_id INTEGER NOT NULL REFERENCES results (id),
        state INTEGER NOT NULL,
        utc TEXT NOT NULL,
        by_whom TEXT NOT NULL
      , checksum INTEGER NOT NULL DEFAULT 0) STRICT;
INSERT INTO transitions VALUES(1,1,0,'2026-11-22T10:00:00Z','',265184883);
INSERT INTO transitions VALUES(2,1,1,'2026-11-22T10:01:00Z','Ada',1407429204);
INSERT INTO transitions VALUES(3,1,2,'2026-11-22T10:01:00Z','Ada',2431539145);
INSERT INTO transitions VALUES(4,2,0,'2026-11-22T10:02:00Z','',1210215400);
INSERT INTO transitions VALUES(5,2,1,'2026-11-22T10:03:00Z','Ada',2490810473);
INSERT INTO transitions VALUES(6,2,2,'2026-11-22T10:03:00Z','Ada',3613130280);
INSERT INTO transitions VALUES(7,3,0,'2026-11-22T10:04:00Z','',3026969652);
INSERT INTO transitions VALUES(8,2,3,'2026-11-22T10:05:00Z','Ada',2241148064);
INSERT INTO transitions VALUES(9,3,1,'2026-11-22T10:05:00Z','Ada',3853277127);
INSERT INTO transitions VALUES(10,3,2,'2026-11-22T10:05:00Z','Ada',4192200579);
INSERT INTO transitions VALUES(11,4,0,'2026-11-22T10:06:00Z','',3832600246);
INSERT INTO transitions VALUES(12,5,0,'2026-11-22T10:07:00Z','',1665324787);
INSERT INTO transitions VALUES(13,5,1,'2026-11-22T10:08:00Z','Ada',223160050);
INSERT INTO transitions VALUES(14,6,0,'2026-11-22T10:09:00Z','',4061679523);
INSERT INTO transitions VALUES(15,7,0,'2026-11-22T10:10:00Z','',2245751546);
INSERT INTO transitions VALUES(16,8,0,'2026-11-22T10:11:00Z','',3904927574);
INSERT INTO transitions VALUES(17,9,0,'2026-11-22T10:12:00Z','',3723024251);
INSERT INTO transitions VALUES(18,9,1,'2026-11-22T10:13:00Z','Ada',3413614243);
INSERT INTO transitions VALUES(19,9,2,'2026-11-22T10:13:00Z','Ada',142238526);
INSERT INTO transitions VALUES(20,10,0,'2026-11-22T10:14:00Z','',2898901117);
INSERT INTO transitions VALUES(21,10,1,'2026-11-22T10:15:00Z','Ada',775683158);
INSERT INTO transitions VALUES(22,10,2,'2026-11-22T10:15:00Z','Ada',2084465089);
INSERT INTO transitions VALUES(23,11,0,'2026-11-22T10:16:00Z','',1612653605);
INSERT INTO transitions VALUES(24,11,1,'2026-11-22T10:17:00Z','Ada',3835426154);
INSERT INTO transitions VALUES(25,11,2,'2026-11-22T10:17:00Z','Ada',680422981);
INSERT INTO transitions VALUES(26,12,0,'2026-11-22T10:18:00Z','',1985092914);
INSERT INTO transitions VALUES(27,12,1,'2026-11-22T10:19:00Z','Ada',2008977797);
INSERT INTO transitions VALUES(28,12,2,'2026-11-22T10:19:00Z','Ada',1877981329);
INSERT INTO transitions VALUES(29,13,0,'2026-11-22T10:20:00Z','',1534450059);
INSERT INTO transitions VALUES(30,13,1,'2026-11-22T10:21:00Z','Ada',569881052);
INSERT INTO transitions VALUES(31,13,2,'2026-11-22T10:21:00Z','Ada',3991022323);
INSERT INTO transitions VALUES(32,14,4,'2026-11-22T10:22:00Z','',444131170);
INSERT INTO transitions VALUES(33,15,0,'2026-11-22T10:23:00Z','',2842377631);
INSERT INTO transitions VALUES(34,16,0,'2026-11-22T10:24:00Z','',4060666973);
INSERT INTO transitions VALUES(35,16,1,'2026-11-22T10:25:00Z','Ada',814736897);
INSERT INTO transitions VALUES(36,16,2,'2026-11-22T10:25:00Z','Ada',1653240726);
CREATE TABLE datasets (
        result_id INTEGER PRIMARY KEY REFERENCES results (id),
        json TEXT NOT NULL
      , checksum INTEGER NOT NULL DEFAULT 0) STRICT;
INSERT INTO datasets VALUES(1,'{"method":"of an earlier version"}',142692934);
INSERT INTO datasets VALUES(2,'{"method":"of an earlier version"}',1798118346);
INSERT INTO datasets VALUES(3,'{"method":"of an earlier version"}',3068989153);
INSERT INTO datasets VALUES(4,'{"method":"of an earlier version"}',2893383890);
INSERT INTO datasets VALUES(5,'{"method":"of an earlier version"}',1907727865);
INSERT INTO datasets VALUES(6,'{"method":"of an earlier version"}',303682677);
INSERT INTO datasets VALUES(7,'{"method":"of an earlier version"}',3487154526);
INSERT INTO datasets VALUES(8,'{"method":"of an earlier version"}',656988179);
INSERT INTO datasets VALUES(9,'{"method":"of an earlier version"}',4209560888);
INSERT INTO datasets VALUES(10,'{"method":"of an earlier version"}',427526870);
INSERT INTO datasets VALUES(11,'{"method":"of an earlier version"}',3300630525);
INSERT INTO datasets VALUES(12,'{"method":"of an earlier version"}',2803357297);
INSERT INTO datasets VALUES(13,'{"method":"of an earlier version"}',2060960602);
INSERT INTO datasets VALUES(15,'{"method":"of an earlier version"}',3180286018);
INSERT INTO datasets VALUES(16,'{"method":"of an earlier version"}',3726842318);
CREATE TABLE standing (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        x_mm REAL NOT NULL,
        y_mm REAL NOT NULL,
        z_mm REAL NOT NULL,
        utc TEXT NOT NULL
      , checksum INTEGER NOT NULL DEFAULT 0) STRICT;
DELETE FROM sqlite_sequence;
INSERT INTO sqlite_sequence VALUES('transitions',36);
INSERT INTO sqlite_sequence VALUES('results',16);
CREATE INDEX transitions_of_a_result ON transitions (result_id);
CREATE UNIQUE INDEX one_active_result ON results (subject, probe, machine, mounting) WHERE state = 2;
CREATE UNIQUE INDEX one_waiting_result ON results (subject, probe, machine, mounting) WHERE state = 1;
COMMIT;
)sql";

}  // namespace probebox::store
