-- One row for each scene: what workers are told of it, but for its name and the size of the picture.
CREATE TABLE scenes (
    hash    TEXT PRIMARY KEY, -- BLAKE3 of `content`
    name    TEXT NOT NULL,    -- what it was called first; renders do not depend on it
    content TEXT NOT NULL     -- JSON; of a map, the BLAKE3 of its pixels
);

-- One row for each picture. All that its pixels depend on is in `description`; other columns read it.
CREATE TABLE renders (
    id          INTEGER PRIMARY KEY,
    key         BLOB NOT NULL UNIQUE, -- BLAKE3 of `description`
    description TEXT NOT NULL,        -- JSON
    renderer    TEXT AS (json_extract(description, '$.renderer')),
    version     TEXT AS (json_extract(description, '$.version')),
    worker      TEXT AS (json_extract(description, '$.worker')), -- BLAKE3 of the worker's files and its command
    model       TEXT AS (json_extract(description, '$.model')),
    parameters  TEXT AS (json_extract(description, '$.parameters')),
    scene       TEXT AS (json_extract(description, '$.scene')),  -- scenes.hash
    light       TEXT AS (json_extract(description, '$.light')),
    size        INTEGER AS (json_extract(description, '$.size')), -- pixels
    samples     INTEGER AS (json_extract(description, '$.samples')), -- per pixel, as asked for
    seed        INTEGER AS (json_extract(description, '$.seed')),
    taken       INTEGER NOT NULL, -- samples per pixel that it took
    cpu_s       REAL NOT NULL,    -- CPU seconds that it took
    wall_s      REAL NOT NULL,    -- seconds by the clock
    noise       REAL,             -- the renderer's own estimate of a pixel's error
    created     TEXT NOT NULL,    -- UTC
    last_used   TEXT NOT NULL,    -- UTC
    bytes       INTEGER NOT NULL, -- of the picture
    checksum    BLOB NOT NULL     -- BLAKE3 of key, taken (4 bytes, little-endian) and picture
);

CREATE INDEX renders_by_use ON renders (last_used);

-- Apart, so that lists need not step over them.
CREATE TABLE pictures (
    id  INTEGER PRIMARY KEY REFERENCES renders (id) ON DELETE CASCADE,
    exr BLOB NOT NULL -- an OpenEXR file, 32-bit float
);
