#!/usr/bin/python3
"""Writes the files that the server carries as one assembler source: the bytes, and a table that assets.cpp reads.

Usage: embed_assets.py --root DIR --output assets.S FILES…

    api/openapi.yaml            → /v1/openapi.json, with the schema  clients/web/…          → /…, index.html also at /
    api/scene.schema.json       → /v1/scene.schema.json              clients/scenes/….json  → /scenes/….json
    clients/scenes/pictures/X.png → /scenes/X.png, of a scene X      a list of these        → /scenes/index.json
"""
import argparse
import datetime
import hashlib
import json
from pathlib import Path

import yaml

MEDIA_TYPES = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".json": "application/json",
}


def write_json(path, value):
    """Only when it differs, so that nothing is built anew for nothing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), default=as_text) + "\n"
    if not path.exists() or path.read_text() != text:
        path.write_text(text)
    return path


def as_text(value):
    if isinstance(value, (datetime.date, datetime.datetime)):
        return value.isoformat()
    raise TypeError(f"{value!r} has no JSON form")


def defaults_in_words(schema):
    """Generators of clients take a member with a default for one that is always there, and ask for it."""
    if isinstance(schema, list):
        return [defaults_in_words(value) for value in schema]
    if not isinstance(schema, dict):
        return schema
    rewritten = {key: defaults_in_words(value) for key, value in schema.items() if key != "default"}
    if "default" in schema:
        default = json.dumps(schema["default"]).strip('"') or "empty"
        rewritten["description"] = f"{schema.get('description', '')} Default: {default}.".strip()
    return rewritten


def composed(openapi, scene):
    """The document with the schema of job bodies among its own, which refers to nothing outside of itself."""
    body = {key: value for key, value in scene.items() if not key.startswith("$")}
    schemas = {"JobRequest": body, **scene["$defs"]}
    twice = schemas.keys() & openapi["components"]["schemas"].keys()
    if twice:
        raise SystemExit(f"openapi.yaml and scene.schema.json both name {', '.join(sorted(twice))}")
    components = {**openapi["components"], "schemas": {**openapi["components"]["schemas"], **defaults_in_words(schemas)}}
    text = json.dumps({**openapi, "components": components}, default=as_text)
    own = "#/components/schemas/"
    return json.loads(text.replace('"#/$defs/', f'"{own}').replace('"scene.schema.json"', f'"{own}JobRequest"'))


def collect(root, generated, files):
    """(path as served, media type, file) of everything."""
    served = []
    scenes = []
    pictures = {file.stem: file for file in files if file.parent.name == "pictures"}
    for file in files:
        if file.parent.name == "pictures":
            continue
        name = file.resolve().relative_to(root).as_posix()
        media_type = MEDIA_TYPES[file.suffix] if file.suffix in MEDIA_TYPES else None
        if name == "api/openapi.yaml":
            scene = json.loads(file.with_name("scene.schema.json").read_text())
            document = composed(yaml.safe_load(file.read_text()), scene)
            served.append(("/v1/openapi.json", MEDIA_TYPES[".json"], write_json(generated / "openapi.json", document)))
        elif name == "api/scene.schema.json":
            served.append(("/v1/scene.schema.json", "application/schema+json", file))
        elif name.startswith("clients/scenes/"):
            path = "/" + name.removeprefix("clients/")
            if path == "/scenes/index.json":
                raise SystemExit(f"{name}: this list is made here")
            picture = path.removesuffix(".json") + ".png" if file.stem in pictures else None
            scenes.append({"name": file.stem, "path": path, "picture": picture})
            served.append((path, media_type, file))
            if picture:
                served.append((picture, MEDIA_TYPES[".png"], pictures[file.stem]))
        elif name.startswith("clients/web/") and media_type:
            path = "/" + name.removeprefix("clients/web/")
            served.append((path, media_type, file))
            if path == "/index.html":
                served.append(("/", media_type, file))
        else:
            raise SystemExit(f"{name}: it is not known where to serve this")
    scenes.sort(key=lambda scene: scene["name"])
    served.append(("/scenes/index.json", MEDIA_TYPES[".json"], write_json(generated / "scenes.json", scenes)))
    return sorted(served, key=lambda entry: entry[0])


def quoted(text):
    return json.dumps(str(text), ensure_ascii=True)


def assembler(served):
    lines = ['.section .note.GNU-stack,"",%progbits', ".section .rodata"]
    table = []
    for number, (path, media_type, file) in enumerate(served):
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        for part, text in (("path", path), ("type", media_type), ("hash", digest)):
            lines += [f".L{part}{number}: .ascii {quoted(text)}", f".L{part}{number}_end:"]
            table.append(f".quad .L{part}{number}, .L{part}{number}_end - .L{part}{number}")
        lines += [".balign 16", f".Lbytes{number}: .incbin {quoted(file.resolve())}", f".Lbytes{number}_end:"]
        table.append(f".quad .Lbytes{number}, .Lbytes{number}_end - .Lbytes{number}")
    lines += ['.section .data.rel.ro,"aw"', ".balign 8", ".globl penumbra_assets", "penumbra_assets:", *table]
    lines += [".globl penumbra_asset_count", f"penumbra_asset_count: .quad {len(served)}"]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=Path, required=True)
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("files", type=Path, nargs="*")
    arguments = parser.parse_args()
    served = collect(arguments.root.resolve(), arguments.output.parent / "assets", arguments.files)
    arguments.output.write_text(assembler(served))


if __name__ == "__main__":
    main()
