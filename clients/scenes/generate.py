#!/usr/bin/python3
"""Writes the example scenes that are ours: hard-and-soft, glass-and-mirrors, thousand-spheres, and cow, which needs the
path of Keenan Crane's spot.obj. Usage: clients/scenes/generate.py [SPOT.OBJ]"""
import colorsys
import json
import math
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def rounded(value):
    if isinstance(value, float):
        return round(value, 5)
    if isinstance(value, list):
        return [rounded(v) for v in value]
    if isinstance(value, dict):
        return {k: rounded(v) for k, v in value.items()}
    return value


def write(name, scene, **options):
    materials = list(scene["materials"].values()) + [o["material"] for o in scene["objects"] if isinstance(o.get("material"), dict)]
    for material in materials:
        # Ambient light is reflected in the material's own colour.
        material.setdefault("ambient", material["diffuse"])
    job = rounded({"scene": {"name": name, **scene}, "options": options})
    (HERE / f"{name}.json").write_text(json.dumps(job, separators=(",", ":")) + "\n")


def quad(a, b, c, d, material):
    return {"type": "polygon", "vertices": [a, b, c, d], "material": material}


def box(x, y, z, w, h, d, material):
    """From its base's center, faces counter-clockwise from outside."""
    l, r, f, b, t = x - w / 2, x + w / 2, z + d / 2, z - d / 2, y + h
    return {"type": "group", "objects": [
        quad([l, y, f], [r, y, f], [r, t, f], [l, t, f], material), quad([r, y, b], [l, y, b], [l, t, b], [r, t, b], material),
        quad([l, y, b], [l, y, f], [l, t, f], [l, t, b], material), quad([r, y, f], [r, y, b], [r, t, b], [r, t, f], material),
        quad([l, t, f], [r, t, f], [r, t, b], [l, t, b], material)]}


def hard_and_soft():
    objects = [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "stage"},
               {"type": "plane", "point": [0, 0, -5], "normal": [0, 0, 1], "material": "wall"}]
    for i, height in enumerate([1.2, 2.0, 2.8, 2.0, 1.2]):
        x = (i - 2) * 1.5
        objects.append({"type": "cylinder", "point": [x, 0, -0.6 * abs(i - 2)], "direction": [0, 1, 0], "radius": 0.16,
                        "height": height, "material": "column"})
        objects.append({"type": "sphere", "center": [x, height + 0.3, -0.6 * abs(i - 2)], "radius": 0.34, "material": "ball"})
    objects.append(box(-1.9, 0, 1.7, 0.8, 0.8, 0.8, "ball"))
    objects.append(box(1.9, 0, 1.7, 0.8, 0.8, 0.8, "ball"))
    write("hard-and-soft", {
        "camera": {"position": [0, 4.6, 10.5], "look_at": [0, 1.0, -0.8], "vertical_fov": 33},
        "ambient": [0.22, 0.22, 0.26],
        "background": [0.05, 0.06, 0.08],
        "materials": {"stage": {"diffuse": [0.62, 0.6, 0.57]}, "wall": {"diffuse": [0.5, 0.51, 0.55]},
                      "column": {"diffuse": [0.75, 0.72, 0.66], "specular": 0.15, "shininess": 30},
                      "ball": {"diffuse": [0.72, 0.22, 0.12], "specular": 0.35, "shininess": 60}},
        "objects": objects,
        "lights": [{"type": "point", "position": [-7, 7, 6], "intensity": [0.62, 0.5, 0.36], "radius": 0},
                   {"type": "point", "position": [7, 7, 6], "intensity": [0.36, 0.46, 0.62], "radius": 1.4}],
    }, width=960, height=640, samples_per_pixel=4, shadow_samples=64)


def glass_and_mirrors():
    objects, squares = [], 7
    for i in range(-squares, squares):
        for k in range(-squares, squares):
            objects.append(quad([i, 0, k + 1], [i + 1, 0, k + 1], [i + 1, 0, k], [i, 0, k], "light" if (i + k) % 2 else "dark"))
    objects += [
        {"type": "sphere", "center": [0.2, 1.1, 1.2], "radius": 1.1, "material": "glass"},
        {"type": "sphere", "center": [-2.4, 1.3, -0.8], "radius": 1.3, "material": "chrome"},
        {"type": "sphere", "center": [2.6, 0.9, -0.3], "radius": 0.9, "material": "amber"},
        {"type": "sphere", "center": [2.0, 0.45, 2.5], "radius": 0.45, "material": "rose"},
        {"type": "sphere", "center": [-1.5, 0.4, 2.6], "radius": 0.4, "material": "teal"},
        {"type": "sphere", "center": [-3.6, 0.5, 1.9], "radius": 0.5, "material": "gold"},
        quad([-4.6, 0.05, -4.2], [4.6, 0.05, -4.2], [4.6, 4.4, -4.2], [-4.6, 4.4, -4.2], "mirror"),
        quad([-4.75, 0, -4.25], [4.75, 0, -4.25], [4.75, 4.55, -4.25], [-4.75, 4.55, -4.25], "frame"),
    ]
    panes = [[0.9, 0.25, 0.2], [0.95, 0.7, 0.2], [0.25, 0.75, 0.4], [0.2, 0.45, 0.9]]
    for row in range(3):
        for column in range(4):
            color = panes[(column + row) % 4]
            x, y, z = 4.6, 0.4 + 1.1 * row, -2.6 + 1.1 * column
            objects.append({"type": "polygon", "vertices": [[x, y, z], [x, y, z + 1], [x, y + 1, z + 1], [x, y + 1, z]],
                            "material": {"diffuse": [0.05 * c for c in color], "specular": 0.2, "shininess": 80,
                                         "transmission": color}})
    write("glass-and-mirrors", {
        "camera": {"position": [-1.6, 3.1, 9.2], "look_at": [0.1, 1.15, 0], "vertical_fov": 40},
        "ambient": 0.3,
        "background": [0.2, 0.3, 0.48],
        "materials": {
            "light": {"diffuse": [0.75, 0.73, 0.68], "specular": 0.1, "shininess": 40, "reflection": 0.06},
            "dark": {"diffuse": [0.1, 0.11, 0.14], "specular": 0.1, "shininess": 40, "reflection": 0.1},
            "glass": {"diffuse": 0.01, "specular": 0.8, "shininess": 300, "reflection": 0.08, "transmission": 0.92, "ior": 1.5},
            "amber": {"diffuse": 0.01, "specular": 0.8, "shininess": 300, "reflection": 0.08,
                      "transmission": [0.95, 0.7, 0.25], "ior": 1.5},
            "rose": {"diffuse": [0.6, 0.1, 0.16], "specular": 0.4, "shininess": 80},
            "teal": {"diffuse": [0.05, 0.4, 0.42], "specular": 0.4, "shininess": 80},
            "gold": {"diffuse": [0.35, 0.22, 0.05], "specular": [0.8, 0.6, 0.2], "shininess": 60, "reflection": [0.35, 0.25, 0.08]},
            "chrome": {"diffuse": 0.03, "specular": 0.7, "shininess": 200, "reflection": [0.86, 0.87, 0.9]},
            "mirror": {"diffuse": 0.02, "reflection": [0.8, 0.83, 0.82], "specular": 0.3, "shininess": 200},
            "frame": {"diffuse": [0.25, 0.14, 0.07]}},
        "objects": objects,
        "lights": [{"type": "point", "position": [9, 7, 2.5], "intensity": [0.85, 0.8, 0.7], "radius": 0.7},
                   {"type": "point", "position": [-5, 8, 7], "intensity": [0.3, 0.33, 0.4], "radius": 1.2}],
    }, width=960, height=640, samples_per_pixel=4, shadow_samples=64)


def thousand_spheres():
    objects = [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "ground"}]
    materials = {"ground": {"diffuse": [0.5, 0.48, 0.45]}}
    for hue in range(24):
        r, g, b = colorsys.hsv_to_rgb(0.52 + 0.5 * hue / 24, 0.62, 0.75)
        materials[f"c{hue}"] = {"diffuse": [r ** 2.2, g ** 2.2, b ** 2.2], "specular": 0.25, "shininess": 50}
    count = 4000
    for i in range(count):
        angle, distance = i * math.pi * (3 - math.sqrt(5)), 0.15 * math.sqrt(i + 0.5)
        wave = math.cos(1.5 * distance) * math.exp(-0.18 * distance)
        radius = 0.105 + 0.02 * math.sin(5 * angle)
        objects.append({"type": "sphere", "center": [distance * math.cos(angle), radius + 0.9 + 0.9 * wave, distance * math.sin(angle)],
                        "radius": radius, "material": f"c{int(24 * distance / 9.5) % 24}"})
    write("thousand-spheres", {
        "camera": {"position": [0, 6.4, 12.5], "look_at": [0, 0.6, 0.6], "vertical_fov": 38},
        "ambient": [0.2, 0.22, 0.28],
        "background": [0.4, 0.5, 0.62],
        "materials": materials,
        "objects": objects,
        "lights": [{"type": "point", "position": [-8, 9, 4], "intensity": [0.85, 0.76, 0.62], "radius": 0.9},
                   {"type": "point", "position": [9, 5, 6], "intensity": [0.22, 0.28, 0.4], "radius": 1.5}],
    }, width=960, height=640, samples_per_pixel=4, shadow_samples=36)


def cow(path):
    positions, faces = [], []
    for line in Path(path).read_text().splitlines():
        fields = line.split()
        if fields[:1] == ["v"]:
            positions.append([float(x) for x in fields[1:4]])
        elif fields[:1] == ["f"]:
            corners = [int(f.split("/")[0]) - 1 for f in fields[1:]]
            faces += [[corners[0], corners[k - 1], corners[k]] for k in range(2, len(corners))]
    normals = [[0.0, 0.0, 0.0] for _ in positions]
    for face in faces:
        a, b, c = (positions[i] for i in face)
        u, v = [b[k] - a[k] for k in range(3)], [c[k] - a[k] for k in range(3)]
        n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        for i in face:
            normals[i] = [normals[i][k] + n[k] for k in range(3)]
    normals = [[x / math.sqrt(sum(y * y for y in n)) for x in n] for n in normals]
    floor = min(p[1] for p in positions)
    mesh = {"positions": [x for p in positions for x in p], "indices": [i for f in faces for i in f],
            "normals": [x for n in normals for x in n]}

    def placed(x, z, turn, size):
        c, s = size * math.cos(turn), size * math.sin(turn)
        return [c, 0, -s, 0, 0, size, 0, 0, s, 0, c, 0, x, -floor * size, z, 1]

    def post(x, z, height):
        return {"type": "cylinder", "point": [x, 0, z], "direction": [0, 1, 0], "radius": 0.045, "height": height, "material": "wood"}

    # A fence behind them, and daisies where the golden angle puts them.
    objects = [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "meadow"},
               {"type": "instance", "mesh": "spot", "transform": placed(0, 0, 0.25, 1.0), "material": "hide"},
               {"type": "instance", "mesh": "spot", "transform": placed(-1.45, -0.5, -0.75, 0.5), "material": "calf"},
               {"type": "instance", "mesh": "spot", "transform": placed(1.0, 2.0, 0.9, 0.9), "material": "calf"}]
    along = [math.cos(0.5), math.sin(0.5)]
    for i in range(-8, 9):
        x, z = -1.0 + 0.95 * i * along[0], 3.6 + 0.95 * i * along[1]
        objects.append(post(x, z, 0.85))
        # A rail from post to post: a long slanting one would have a box as large as the meadow.
        for height in (0.38, 0.68):
            objects.append({"type": "cylinder", "point": [x, height, z], "direction": [along[0], 0, along[1]],
                            "radius": 0.028, "height": 0.95, "material": "wood"})
    for i in range(240):
        angle, distance = i * math.pi * (3 - math.sqrt(5)), 0.27 * math.sqrt(i + 0.5)
        size = 0.016 + 0.008 * math.sin(3 * i)
        objects.append({"type": "sphere", "center": [distance * math.cos(angle), size, distance * math.sin(angle) + 0.4],
                        "radius": size, "material": "yolk" if i % 5 == 0 else "petal"})
    write("cow", {
        "camera": {"position": [2.3, 1.6, -3.7], "look_at": [-0.3, 0.72, 0.2], "vertical_fov": 32},
        "ambient": [0.27, 0.3, 0.36],
        "background": [0.36, 0.56, 0.85],
        "materials": {"hide": {"diffuse": [0.68, 0.58, 0.46], "specular": 0.06, "shininess": 20},
                      "calf": {"diffuse": [0.38, 0.2, 0.1], "specular": 0.08, "shininess": 20},
                      "wood": {"diffuse": [0.3, 0.19, 0.11]}, "petal": {"diffuse": [0.8, 0.8, 0.76]},
                      "yolk": {"diffuse": [0.8, 0.55, 0.08]}, "meadow": {"diffuse": [0.15, 0.25, 0.06]}},
        "meshes": {"spot": mesh},
        "objects": objects,
        "lights": [{"type": "directional", "direction": [-1.0, -0.85, 0.75], "intensity": [0.92, 0.8, 0.6], "angular_radius": 2.5},
                   {"type": "rectangle", "corner": [-2.5, 2.4, -3.6], "edge_u": [2.0, 0, -0.8], "edge_v": [0.34, 1.22, 0.84],
                    "intensity": [1.6, 1.8, 2.2]}],
    }, width=960, height=640, samples_per_pixel=4, shadow_samples=16)


hard_and_soft()
glass_and_mirrors()
thousand_spheres()
if len(sys.argv) > 1:
    cow(sys.argv[1])
