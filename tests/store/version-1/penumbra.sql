-- A store that version 1.0 has left: three images, and three jobs that were not done.
PRAGMA application_id=1348824693;
PRAGMA user_version=1;
PRAGMA foreign_keys=OFF;
BEGIN TRANSACTION;
CREATE TABLE images (
  hash TEXT PRIMARY KEY,
  bytes INTEGER NOT NULL,
  media_type TEXT NOT NULL,
  preview TEXT,
  preview_bytes INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
INSERT INTO "images" VALUES('138ffcdf18b277073a2bb11b8e0774546ca7ef78cb22028162f8b7646cf34e5d',162,'image/png',NULL,0);
INSERT INTO "images" VALUES('1c9191d6a3fc2696bdad08e779b6bc236174a7293a97869d7cbf04e544551497',121,'image/png',NULL,0);
INSERT INTO "images" VALUES('e4ce9b134c92b9efa5455325985725f5d25ae35af5f513fe7ff5df23ec719c71',871,'image/x-exr','33de0d8db58d0d638b01a6af6923bd983916ab3bdb7598e29f30b9db227b26b7',344);
CREATE TABLE jobs (
  id TEXT PRIMARY KEY,
  owner TEXT NOT NULL,
  state INTEGER NOT NULL CHECK (state BETWEEN 0 AND 4),
  priority INTEGER NOT NULL,
  progress_interval_s REAL NOT NULL,
  percent REAL NOT NULL,
  crashes INTEGER NOT NULL,
  created_at INTEGER NOT NULL,
  started_at INTEGER,
  finished_at INTEGER,
  error TEXT,
  stats TEXT,
  spec_hash TEXT NOT NULL,
  image TEXT REFERENCES images
) STRICT, WITHOUT ROWID;
INSERT INTO "jobs" VALUES('01M8JX6A7W6A9RPK0VHZSASVKK','',2,0,0.5,100.0,0,1795930925308585309,1795930925313813290,1795930925319434298,NULL,'11:0.00018569311:0.00052754311:0.0008081971:03:1282:151:01:018:area_samples_exact1:019:camera_rays_bundled3:11211:empty_tiles1:014:hidden_spheres1:018:lights_facing_away1:122:lights_from_candidates1:017:lights_from_cells1:021:lights_without_effect1:013:merged_lights1:015:negligible_rays1:019:shadow_rays_bundled1:019:shadow_rays_covered1:016:shadow_rays_dark1:018:shadow_rays_listed1:015:shadow_rays_lit1:0','e0172f2aff54c8e6e2f1f797b847956dd5fed21e8c6bbe812ff22d73ccca57d4','138ffcdf18b277073a2bb11b8e0774546ca7ef78cb22028162f8b7646cf34e5d');
INSERT INTO "jobs" VALUES('01M8JX6AV20B6HMR1MNY6B6MN6','',2,0,0.5,100.0,0,1795930925922129800,1795930925927406803,1795930925934291344,NULL,'10:2.0799e-0511:0.00459727110:0.000609891:03:1281:41:01:018:area_samples_exact1:019:camera_rays_bundled3:11211:empty_tiles1:914:hidden_spheres1:018:lights_facing_away1:022:lights_from_candidates1:017:lights_from_cells1:021:lights_without_effect1:013:merged_lights1:015:negligible_rays1:019:shadow_rays_bundled1:019:shadow_rays_covered1:016:shadow_rays_dark1:018:shadow_rays_listed1:015:shadow_rays_lit1:0','a9f7a82e92c31dff9b9640395d08a58c4fe8839732da58d0ccece440130c7abc','1c9191d6a3fc2696bdad08e779b6bc236174a7293a97869d7cbf04e544551497');
INSERT INTO "jobs" VALUES('01M8JX6BE16RHCBTKQH21EESPT','',2,0,0.5,100.0,0,1795930926529716122,1795930926532813732,1795930927301227505,NULL,'10:2.2693e-0511:0.02784981411:0.7345920941:03:2402:831:01:018:area_samples_exact1:019:camera_rays_bundled3:20011:empty_tiles1:014:hidden_spheres1:018:lights_facing_away2:1322:lights_from_candidates1:017:lights_from_cells1:021:lights_without_effect1:013:merged_lights1:015:negligible_rays1:019:shadow_rays_bundled1:019:shadow_rays_covered1:016:shadow_rays_dark1:018:shadow_rays_listed1:015:shadow_rays_lit1:0','ba5e4bbb711c3cab0e661aedd7b1f99d2329484bd650f082122f7cb47fc6ef91','e4ce9b134c92b9efa5455325985725f5d25ae35af5f513fe7ff5df23ec719c71');
INSERT INTO "jobs" VALUES('01M8JX6CX4N28425TA3G1EXQQK','',0,0,0.5,1.37119106353306854375e+01,0,1795930928036613970,NULL,NULL,NULL,NULL,'2389f0a3ed55f5301fb6144696078eb1e68deb7a1588b1f8eb4e703d33bbed5b',NULL);
INSERT INTO "jobs" VALUES('01M8JX6DCVE8YBP51NYWD8YERE','',0,0,0.5,0.0,0,1795930928539743144,NULL,NULL,NULL,NULL,'362592ccc3366a986a3f17979ff4f5e3386f12b590225c673b9d38a49592abf7',NULL);
INSERT INTO "jobs" VALUES('01M8JX6DD10TJ6QG2FT7CMQSQS','',0,0,0.5,0.0,0,1795930928545878410,NULL,NULL,NULL,NULL,'2eeb78d5311fa5760e9db63dbcdf8d3973a32ca24af60f0a503994024376c6a0',NULL);
CREATE TABLE keys (
  owner TEXT NOT NULL,
  key TEXT NOT NULL,
  body_hash TEXT NOT NULL,
  job TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  PRIMARY KEY (owner, key)
) STRICT, WITHOUT ROWID;
CREATE TABLE specs (
  job TEXT PRIMARY KEY REFERENCES jobs ON DELETE CASCADE,
  body TEXT NOT NULL
) STRICT;
INSERT INTO "specs" VALUES('01M8JX6CX4N28425TA3G1EXQQK','{"scene": {"name": "runs", "camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40}, "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}], "lights": [{"type": "point", "position": [3, 4, 5], "intensity": 1}]}, "options": {"width": 1200, "height": 1200, "samples_per_pixel": 1024}}');
INSERT INTO "specs" VALUES('01M8JX6DCVE8YBP51NYWD8YERE','{ "scene": {"name": "Wei\u00df \"x\"", "camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40}, "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}], "lights": [{"type": "point", "position": [3, 4, 5], "intensity": 1}]}, "options": {"width": 6e0, "height": 5, "format": "exr"}}');
INSERT INTO "specs" VALUES('01M8JX6DD10TJ6QG2FT7CMQSQS','{"scene": {"camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40}, "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}], "lights": [{"type": "point", "position": [3, 4, 5], "intensity": 1}]}}');
CREATE TABLE totals (image_bytes INTEGER NOT NULL, finished_jobs INTEGER NOT NULL, engine TEXT NOT NULL) STRICT;
INSERT INTO "totals" VALUES(1498,3,'1.0.0-fc47c6303a074a2efffaf3bf4160218b2c096a50f701006c8d9f666e59520e40');
CREATE INDEX images_preview ON images (preview) WHERE preview IS NOT NULL;
CREATE INDEX jobs_owner ON jobs (owner, id);
CREATE INDEX jobs_state ON jobs (state, id);
CREATE INDEX jobs_owner_state ON jobs (owner, state, id);
CREATE INDEX jobs_finished ON jobs (finished_at) WHERE state > 1;
CREATE INDEX jobs_imaged ON jobs (id) WHERE image IS NOT NULL;
CREATE INDEX jobs_imaged_finished ON jobs (finished_at) WHERE image IS NOT NULL;
CREATE INDEX jobs_image ON jobs (image) WHERE image IS NOT NULL;
CREATE INDEX jobs_spec_hash ON jobs (spec_hash) WHERE image IS NOT NULL AND spec_hash <> '';
CREATE INDEX keys_job ON keys (job);
CREATE TRIGGER image_added AFTER INSERT ON images BEGIN
  UPDATE totals SET image_bytes = image_bytes + NEW.bytes + NEW.preview_bytes;
END;
CREATE TRIGGER image_dropped AFTER DELETE ON images BEGIN
  UPDATE totals SET image_bytes = image_bytes - OLD.bytes - OLD.preview_bytes;
END;
CREATE TRIGGER job_added AFTER INSERT ON jobs WHEN NEW.state > 1 BEGIN
  UPDATE totals SET finished_jobs = finished_jobs + 1;
END;
CREATE TRIGGER job_finished AFTER UPDATE OF state ON jobs WHEN OLD.state < 2 AND NEW.state > 1 BEGIN
  UPDATE totals SET finished_jobs = finished_jobs + 1;
END;
CREATE TRIGGER job_dropped AFTER DELETE ON jobs WHEN OLD.state > 1 BEGIN
  UPDATE totals SET finished_jobs = finished_jobs - 1;
END;
COMMIT;
