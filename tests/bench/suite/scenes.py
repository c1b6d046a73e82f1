"""The scenes of the benchmark as POST bodies. Shapes are matte, so that every peer can express them (what it knows of lights,
normals and instances); room-flat and the teapot come from tests/support/predecessor/. sphereflake, tetra, mount and rings follow the descriptions of Eric Haines, "A Proposal
for Standard Graphics Environments", IEEE CG&A 7(11), 1987."""
import itertools
import json
import math
import os
import random
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
EDGE = 800  # pixels of every image
EDGES = {"lights-1000": 100}  # but of those: a ray for each point and light is 300 million in 800 x 800
PATIENCE = {"lights-1000": 15}  # seconds of one picture, after which a renderer is asked for no finer one, if not 30
# Of corners in the order of their coordinates.
BOX_FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [1, 5, 7], [1, 7, 3], [0, 2, 6], [0, 6, 4]]


def meshes_folder():
    """Where stanford-bunny.obj is: PENUMBRA_MESHES, or the shared folder beside the repository."""
    return Path(os.environ.get("PENUMBRA_MESHES", ROOT.parent / "shared/scenes/meshes"))


def body(name, camera, objects, lights, ambient=0.1, background=0.0):
    scene = {"name": name, "camera": camera, "background": background, "ambient": ambient, "objects": objects, "lights": lights}
    return {"scene": scene, "options": {"width": EDGE, "height": EDGE, "transfer": "linear"}}


def camera(position, look_at, fov, up=(0, 1, 0)):
    return {"position": list(position), "look_at": list(look_at), "up": list(up), "vertical_fov": fov}


def light(position, radius, intensity):
    return {"type": "point", "position": list(position), "intensity": intensity, "radius": radius}


def matte(*color):
    return {"diffuse": list(color), "ambient": list(color)}


def numbers(positions, triangles):
    return {"positions": np.asarray(positions, float).ravel().tolist(), "indices": np.asarray(triangles, int).ravel().tolist()}


def mesh(positions, triangles, material):
    return {"type": "mesh", **numbers(positions, triangles), "material": material}


def floor(height, half, material, up_axis=1):
    """A square facing up, of two triangles."""
    corners = [(-half, -half), (-half, half), (half, half), (half, -half)]
    if up_axis == 2:
        corners = [(y, x) for x, y in corners]
    place = (lambda x, z: [x, height, z]) if up_axis == 1 else (lambda x, y: [x, y, height])
    return mesh([place(*c) for c in corners], [[0, 1, 2], [0, 2, 3]], material)


def on_disk(name, radius=None):
    job = json.loads((ROOT / f"tests/support/predecessor/{name}.json").read_text())
    job["options"] = {"width": EDGE, "height": EDGE, "transfer": "linear"}
    for each in job["scene"]["lights"]:
        if radius is not None:
            each["radius"] = radius
    return job


def bunny_mesh():
    """About 1.5 units tall, on the floor."""
    positions, triangles = [], []
    for line in (meshes_folder() / "stanford-bunny.obj").read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            positions.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            triangles.append([int(w.split("/")[0]) - 1 for w in words[1:4]])
    return mesh(np.array(positions) * 10 - [-0.17, 0.33, 0], triangles, matte(0.8, 0.7, 0.6))


def bunny_under(name, lights):
    return body(name, camera((0.6, 1.6, 3.6), (0, 0.65, 0), 36), [bunny_mesh(), floor(0, 6, matte(0.7, 0.7, 0.75))], lights)


def bunny(lights):
    around = [light((2.4 * math.cos(a), 2.6 + 0.3 * (i % 2), 2.4 * math.sin(a)), 0.25, 0.8 / lights)
              for i, a in ((i, 0.9 + 2 * math.pi * i / lights) for i in range(lights))]
    return bunny_under(f"bunny-{lights}", around)


def sphereflake(depth=4):
    """Every ball carries nine of a third of its size: six around its equator, three above."""
    spheres = []
    elevated = math.asin(math.sqrt(2 / 3))
    directions = [(i * math.pi / 3, 0.0) for i in range(6)] + [(math.pi / 6 + i * 2 * math.pi / 3, elevated) for i in range(3)]

    def grow(center, radius, axis, level):
        spheres.append({"type": "sphere", "center": center.tolist(), "radius": radius, "material": "ball"})
        if level == 0:
            return
        helper = np.eye(3)[np.argmin(np.abs(axis))]
        u = np.cross(axis, helper)
        u /= np.linalg.norm(u)
        v = np.cross(axis, u)
        for azimuth, elevation in directions:
            out = math.cos(elevation) * (math.cos(azimuth) * u + math.sin(azimuth) * v) + math.sin(elevation) * axis
            grow(center + out * (radius * 4 / 3), radius / 3, out, level - 1)

    grow(np.zeros(3), 0.5, np.array([0.0, 0.0, 1.0]), depth)
    lights = [light((4, 3, 2), 0.3, 0.45), light((1, -4, 4), 0.3, 0.45), light((-3, 1, 5), 0.3, 0.45)]
    job = body("sphereflake", camera((2.1, 1.3, 1.7), (0, 0, 0), 45, (0, 0, 1)),
               [*spheres, floor(-0.5, 12, matte(0.8, 0.7, 0.4), 2)], lights, background=[0.078, 0.361, 0.753])
    job["scene"]["materials"] = {"ball": matte(0.7, 0.55, 0.4)}
    return job


def tetra(depth=6):
    """Sierpinski's pyramid: 4^depth triangles."""
    corners = np.array([[1, 1, 1], [-1, -1, 1], [1, -1, -1], [-1, 1, -1]], float)
    tetrahedra = corners[None]
    for _ in range(depth - 1):
        tetrahedra = np.concatenate([(tetrahedra + tetrahedra[:, i:i + 1]) / 2 for i in range(4)])
    faces = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    triangles = (4 * np.arange(len(tetrahedra))[:, None, None] + faces).reshape(-1, 3)
    return body("tetra", camera((4.2, 1.9, 2.3), (0, -0.1, 0), 34),
                [mesh(tetrahedra.reshape(-1, 3), triangles, matte(0.75, 0.5, 0.35)), floor(-1.02, 9, matte(0.6, 0.65, 0.7))],
                [light((3.5, 5, 3), 0.4, 0.9)])


def mount(depth=6):
    """A fractal mountain of 2·4^depth triangles under four balls (opaque here: the image has no glass to differ in)."""
    size = 2 ** depth
    chance = random.Random(7)
    height = np.zeros((size + 1, size + 1))
    step, amplitude = size, 0.35
    height[::size, ::size] = [[0.1, -0.1], [0.0, -0.05]]
    while step > 1:
        half = step // 2
        for i, j in itertools.product(range(half, size, step), repeat=2):
            height[i, j] = (height[i - half, j - half] + height[i + half, j - half] + height[i - half, j + half] +
                            height[i + half, j + half]) / 4 + amplitude * chance.uniform(-1, 1)
        for i in range(0, size + 1, half):
            for j in range((i + half) % step, size + 1, step):
                near = [height[a, b] for a, b in ((i - half, j), (i + half, j), (i, j - half), (i, j + half))
                        if 0 <= a <= size and 0 <= b <= size]
                height[i, j] = sum(near) / len(near) + amplitude * chance.uniform(-1, 1)
        step, amplitude = half, amplitude * 0.52
    place = np.linspace(-1, 1, size + 1)
    positions = [[place[i], place[j], height[i, j]] for i in range(size + 1) for j in range(size + 1)]
    triangles = []
    for i, j in itertools.product(range(size), repeat=2):
        a, b, c, d = (size + 1) * i + j, (size + 1) * (i + 1) + j, (size + 1) * (i + 1) + j + 1, (size + 1) * i + j + 1
        triangles += [[a, b, c], [a, c, d]]
    balls = [{"type": "sphere", "center": [x, y, 0.85], "radius": 0.22, "material": matte(*color)}
             for x, y, color in ((0.4, 0.4, (0.8, 0.3, 0.3)), (-0.4, 0.4, (0.3, 0.8, 0.3)), (-0.4, -0.4, (0.3, 0.4, 0.8)),
                                 (0.4, -0.4, (0.8, 0.8, 0.3)))]
    return body("mount", camera((-1.6, 1.6, 1.7), (0, 0, 0.1), 45, (0, 0, 1)),
                [mesh(positions, triangles, matte(0.7, 0.65, 0.5)), *balls], [light((-4, -3, 6), 0.5, 1)],
                background=[0.078, 0.361, 0.753])


def rings(layers=7):
    """A pyramid of objects, each of six interlocked pentagons through the midpoints of a dodecahedron's edges: 30
    cylinders and 30 balls."""
    golden = (1 + math.sqrt(5)) / 2
    axes = np.array([[0, golden, 1], [0, -golden, 1], [golden, 1, 0], [-golden, 1, 0], [1, 0, golden], [-1, 0, golden]])
    midpoints = [np.array(p) for p in itertools.product(*[(-1, 1)] * 3)]
    midpoints = [p * [1 / 2, golden / 2, golden ** 2 / 2] for p in midpoints]
    midpoints = np.array([np.roll(p, i) for p in midpoints for i in range(3)] +
                         [s * golden * np.eye(3)[i] for i in range(3) for s in (-1, 1)]) / golden
    decagons = []
    for axis in axes:
        around = [k for k, p in enumerate(midpoints) if abs(axis @ p) < 1e-6]
        u = midpoints[around[0]]
        v = np.cross(axis / np.linalg.norm(axis), u)
        decagons.append(sorted(around, key=lambda k: math.atan2(midpoints[k] @ v, midpoints[k] @ u)))
    choice = next(c for c in itertools.product((0, 1), repeat=6)
                  if len({k for ring, first in zip(decagons, c) for k in ring[first::2]}) == 30)
    objects = []
    for layer in range(layers):
        for i, j in itertools.product(range(layer + 1), repeat=2):
            center = np.array([2 * i - layer, 2 * j - layer, -2.0 * layer])
            for ring, first in zip(decagons, choice):
                pentagon = [center + 0.9 * midpoints[k] for k in ring[first::2]]
                for a, b in zip(pentagon, pentagon[1:] + pentagon[:1]):
                    objects.append({"type": "sphere", "center": a.tolist(), "radius": 0.1, "material": "ball"})
                    objects.append({"type": "cylinder", "point": a.tolist(), "direction": (b - a).tolist(), "radius": 0.07,
                                    "height": float(np.linalg.norm(b - a)), "material": "rod"})
    job = body("rings", camera((-3, -4, 12), (0.4, 0.2, -7), 42),
               [*objects, floor(-2.0 * layers + 1, 30, matte(0.7, 0.7, 0.75), 2)],
               [light((-9, 6, 14), 0.8, 0.45), light((8, 9, 12), 0.8, 0.45), light((3, -12, 13), 0.8, 0.3)])
    job["scene"]["materials"] = {"ball": matte(0.8, 0.65, 0.3), "rod": matte(0.5, 0.6, 0.75)}
    return job


def knot(triangles, name, has_floor):
    """A torus knot (2, 3), smoothly curved."""
    across = max(8, round(math.sqrt(triangles / 24)))
    along = triangles // (2 * across)
    t = np.arange(along) * 2 * math.pi / along
    ring = 0.8 + 0.35 * np.cos(3 * t)
    path = np.stack([ring * np.cos(2 * t), 0.45 * np.sin(3 * t), ring * np.sin(2 * t)], 1)
    tangent = np.roll(path, -1, 0) - np.roll(path, 1, 0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    side = np.cross(tangent, path - 0.01)
    side /= np.linalg.norm(side, axis=1)[:, None]
    up = np.cross(side, tangent)
    angle = np.arange(across) * 2 * math.pi / across
    positions = (path[:, None] + 0.16 * (np.cos(angle)[None, :, None] * side[:, None] + np.sin(angle)[None, :, None] * up[:, None])).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(along), np.arange(across), indexing="ij")
    corner = lambda di, dj: ((i + di) % along * across + (j + dj) % across).ravel()
    a, b, c, d = corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)
    faces = np.concatenate([np.stack([a, c, b], 1), np.stack([a, d, c], 1)])
    objects = [mesh(positions, faces, matte(0.75, 0.6, 0.5))]
    if has_floor:
        objects.append(floor(-0.75, 8, matte(0.6, 0.65, 0.7)))
    return body(name, camera((0.6, 2.2, 3.2), (0, -0.1, 0), 42), objects, [light((2.5, 4, 1.5), 0.5, 0.6), light((-3, 3, 1), 0.4, 0.4)])


def city(edge=24):
    """Boxes of all heights, long shadows."""
    chance = random.Random(3)
    unit = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = np.array(BOX_FACES)
    boxes = {}
    for i, j in itertools.product(range(edge), repeat=2):
        size = np.array([0.62, 0.3 + 2.5 * chance.random() ** 3, 0.62])
        boxes.setdefault(chance.randrange(4), []).append(unit * size + [i - edge / 2, 0, j - edge / 2])
    meshes = [mesh(np.concatenate(some), np.concatenate([faces + 8 * k for k in range(len(some))]), matte(0.75 - 0.1 * m, 0.65, 0.45 + 0.1 * m))
              for m, some in sorted(boxes.items())]
    return body("city", camera((9, 7, 13), (0, 0, 0), 40), [*meshes, floor(0, 30, matte(0.6, 0.6, 0.62))],
                [light((14, 16, 3), 1.2, 0.9)], background=0.3)


def bubbles(count=2000):
    """Balls of all sizes in a box of air."""
    chance = random.Random(5)
    objects = [floor(-1.6, 12, matte(0.65, 0.65, 0.7))]
    for _ in range(count):
        center = [chance.uniform(-1.5, 1.5) for _ in range(3)]
        objects.append({"type": "sphere", "center": center, "radius": 0.02 + 0.12 * chance.random() ** 4,
                        "material": matte(*(0.4 + 0.5 * chance.random() for _ in range(3)))})
    return body("bubbles", camera((2.4, 1.6, 4.2), (0, -0.2, 0), 45), objects, [light((3, 5, 2), 0.5, 0.6), light((-4, 4, 3), 0.5, 0.4)])


def smooth(along=1000, across=100):
    """A torus knot (3, 2) with bumps all over, smoothly shaded, of 2 × along × across triangles, without a floor."""
    def on_knot(s, t):
        middle = lambda a: np.stack([(1 + 0.42 * np.cos(2 * a)) * np.cos(3 * a), 0.5 * np.sin(2 * a),
                                     (1 + 0.42 * np.cos(2 * a)) * np.sin(3 * a)], -1)
        a, b = 2 * math.pi * s, 2 * math.pi * t
        tangent = middle(a + 1e-4) - middle(a - 1e-4)
        tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
        up = np.cross(tangent, np.stack([np.cos(3 * a), 0 * a, np.sin(3 * a)], -1))
        up /= np.linalg.norm(up, axis=-1, keepdims=True)
        bumps = 0.17 + 0.018 * np.sin(90 * a) * np.sin(5 * b)
        return middle(a) + bumps[..., None] * (np.cos(b)[..., None] * np.cross(up, tangent) + np.sin(b)[..., None] * up)

    i, j = np.meshgrid(np.arange(along), np.arange(across), indexing="ij")
    s, t, step = i / along, j / across, 1e-5
    positions = on_knot(s, t).reshape(-1, 3)
    normals = np.cross(on_knot(s, t + step) - on_knot(s, t - step), on_knot(s + step, t) - on_knot(s - step, t)).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    corner = lambda di, dj: ((i + di) % along * across + (j + dj) % across).ravel()
    a, b, c, d = corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)
    faces = np.concatenate([np.stack([a, c, b], 1), np.stack([a, d, c], 1)])
    outwards = np.cross(positions[faces[:, 1]] - positions[faces[:, 0]], positions[faces[:, 2]] - positions[faces[:, 0]])
    if (outwards * normals[faces[:, 0]]).sum() < 0:
        normals = -normals
    knotted = {**mesh(positions, faces, matte(0.7, 0.65, 0.55)), "normals": normals.ravel().tolist()}
    return body("smooth", camera((0.3, 3.0, 2.6), (0, -0.05, 0.05), 44), [knotted],
                [light((2.5, 4, 1), 0.45, 0.6), light((-3, 3, 2.5), 0.35, 0.4)], background=[0.1, 0.12, 0.16])


def tree(leaves=2380, chance=random.Random(11)):
    """A trunk, twigs and leaves of two triangles each, a unit tall: 5,000 triangles."""
    positions, faces = [], []

    def taper(foot, top, radius, sides):
        """A cone without a base."""
        axis = (top - foot) / np.linalg.norm(top - foot)
        u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        u /= np.linalg.norm(u)
        v, first = np.cross(axis, u), len(positions)
        positions.extend(foot + radius * (math.cos(2 * math.pi * k / sides) * u + math.sin(2 * math.pi * k / sides) * v) for k in range(sides))
        positions.append(top)
        faces.extend((first + k, first + (k + 1) % sides, first + sides) for k in range(sides))

    taper(np.zeros(3), np.array([0, 0.95, 0]), 0.035, 12)
    twigs = []
    for k in range(57):
        height = 0.22 + 0.7 * k / 57
        reach = 0.36 * math.sin(math.pi * (0.12 + 0.85 * (height - 0.22) / 0.75))
        turn = 2.39996 * k
        foot = np.array([0, height, 0])
        twigs.append((foot, foot + reach * np.array([math.cos(turn), 0.35, math.sin(turn)])))
        taper(*twigs[-1], 0.007, 4)
    for k in range(leaves):
        foot, top = twigs[k % len(twigs)]
        share = chance.uniform(0.25, 1)
        center = foot + share * (top - foot) + np.array([chance.gauss(0, 0.025) for _ in range(3)])
        u, v = (np.array([chance.gauss(0, 1) for _ in range(3)]) for _ in range(2))
        u *= 0.028 / np.linalg.norm(u)
        v -= u * (u @ v) / (u @ u)
        v *= 0.012 / np.linalg.norm(v)
        first = len(positions)
        positions.extend([center - u, center - v, center + u, center + v])
        faces.extend([(first, first + 1, first + 2), (first, first + 2, first + 3)])
    return positions, faces


def forest(edge=100):
    """edge² instances of one tree on a meadow, seen from its edge, where coordinates are small: single precision is best there."""
    chance = random.Random(7)
    positions, faces = tree()
    objects = [floor(0, 80, matte(0.45, 0.5, 0.3))]
    for i, j in itertools.product(range(edge), repeat=2):
        x, z = (0.75 * k + chance.uniform(-0.25, 0.25) for k in (i - edge / 2, j - edge))
        turn, size, green = chance.uniform(0, 2 * math.pi), chance.uniform(0.8, 1.6), chance.randrange(3)
        c, s = size * math.cos(turn), size * math.sin(turn)
        objects.append({"type": "instance", "mesh": "tree", "material": f"leaf-{green}",
                        "transform": [c, 0, -s, 0, 0, size, 0, 0, s, 0, c, 0, x, 0, z, 1]})
    job = body("forest", camera((3, 3.4, 4), (0, 0.5, -4), 48), objects, [light((60, 45, 22), 2.5, 0.95)],
               background=[0.55, 0.7, 0.9])
    job["scene"]["meshes"] = {"tree": numbers(positions, faces)}
    job["scene"]["materials"] = {f"leaf-{k}": matte(0.35 + 0.1 * k, 0.55, 0.2) for k in range(3)}
    return job


def lamps(count=1000, edge=32):
    """A town at night: a block and a lamp or so on every square; a lamp matters a few squares around it."""
    chance = random.Random(13)
    unit = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = np.array(BOX_FACES)
    boxes, balls = [], []
    for i, j in itertools.product(range(edge), repeat=2):
        corner = np.array([i - edge / 2, 0, j - edge / 2])
        if chance.random() < 0.6:
            boxes.append(unit * [0.55, 0.15 + 0.7 * chance.random() ** 2, 0.55] + corner)
        else:
            balls.append({"type": "sphere", "center": (corner + [0.27, 0.2, 0.27]).tolist(), "radius": 0.2, "material": matte(0.7, 0.6, 0.5)})
    town = mesh(np.concatenate(boxes), np.concatenate([faces + 8 * k for k in range(len(boxes))]), matte(0.65, 0.65, 0.7))
    places = chance.sample([(i, j) for i in range(edge) for j in range(edge)], count)
    lights = [{"type": "point", "position": [i - edge / 2 + 0.78, chance.uniform(0.35, 0.7), j - edge / 2 + 0.78], "radius": 0.12,
               "intensity": [0.08 * c for c in chance.choice([(1, 0.75, 0.45), (1, 0.9, 0.7), (0.6, 0.8, 1)])],
               "attenuation": [0.1, 0, 1]} for i, j in places]
    return body(f"lights-{count}", camera((7, 8, 17), (0, 0, 4), 42), [town, *balls, floor(0, 30, matte(0.6, 0.6, 0.62))], lights, ambient=0.03)


SCENES = {
    "room-flat": lambda: on_disk("room-flat"),
    "teapot": lambda: on_disk("teapot", radius=8),
    "bunny-1": lambda: bunny(1),
    "bunny-8": lambda: bunny(8),
    "sphereflake": sphereflake,
    "tetra": tetra,
    "mount": mount,
    "rings": rings,
    "knot": lambda: knot(200_000, "knot", False),
    "city": city,
    "bubbles": bubbles,
    "area-rectangle": lambda: bunny_under("area-rectangle", [{"type": "rectangle", "corner": [-0.4, 3.2, -0.5], "edge_u": [1.8, 0, 0],
                                                              "edge_v": [0, 0, 1.2], "intensity": 6}]),
    "area-sphere": lambda: bunny_under("area-sphere", [{"type": "sphere", "center": [1.5, 2.6, 1.9], "radius": 0.4, "intensity": 60}]),
    "smooth": smooth,
    "forest": forest,
    "lights-1000": lamps,
}


def write(name, folder):
    """The file of the scene's POST body. Where it was another scene, its reference images are removed, beside the folder."""
    path, text = Path(folder) / f"{name}.json", json.dumps(SCENES[name]())
    if not path.is_file() or path.read_text() != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        for image in (path.parents[1] / "references").glob(f"{name}-*"):
            image.unlink()
    return path


def body_of(name):
    return SCENES[name]()
