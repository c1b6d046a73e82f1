"""POV-Ray 3.7: soft lights as `area_light … circular orient`, which is the contract's disc but for its own grid of samples."""
import os
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from suite.peers import NotExpressible

VARIANTS = {  # name → (words inside the light, sizes of its grid, ascending)
    "povray grid": ("", [2, 4, 8, 16]),
    "povray jitter": ("jitter", [2, 4, 8, 16]),
    "povray adaptive": ("adaptive 1", [5, 9, 17]),
    "povray adaptive jitter": ("adaptive 1 jitter", [5, 9, 17]),
}
IS_RANDOM = False  # no seeds: what is measured is among the finest images
EXTENT = 100  # POV-Ray's tolerances are absolute, about 1e-3: scenes are enlarged until those do not matter


def grey(color):
    return [color] * 3 if isinstance(color, (int, float)) else list(color)


def vector(values):
    return "<" + ",".join(f"{float(v):.9g}" for v in values) + ">"


def size_of(scene):
    """The largest coordinate of anything but the camera."""
    largest = 0.0
    for shape in scene["objects"]:
        for key in ("positions", "center", "point"):
            if key in shape:
                largest = max(largest, float(np.abs(shape[key]).max()))
        if "vertices" in shape:
            largest = max(largest, float(np.abs(shape["vertices"]).max()))
        if shape["type"] == "group":
            largest = max(largest, size_of(shape))
    return largest


def texture(material, ambient):
    """Pigment × (ambient + diffuse·cosine) + phong, with the contract's emission in POV-Ray's ambient term."""
    for key in ("transmission", "ior"):
        if any(grey(material.get(key, 0))):
            raise NotExpressible(key)
    diffuse = np.maximum(grey(material.get("diffuse", 0)), 1e-6)
    glow = (np.array(grey(material.get("emission", 0))) + ambient * grey(material.get("ambient", 1))) / diffuse
    specular, reflection = grey(material.get("specular", 0)), grey(material.get("reflection", 0))
    if len(set(specular)) > 1:
        raise NotExpressible("coloured highlight")
    shininess = material.get("shininess", 0)
    if any(specular) and shininess == 0:
        raise NotExpressible("a highlight of exponent 0")
    return (f"texture {{ pigment {{ rgb {vector(diffuse)} }} finish {{ ambient rgb {vector(glow)} diffuse 1 "
            f"phong {specular[0]:.9g} phong_size {shininess:.9g} reflection {{ rgb {vector(reflection)} }} }} }}")


class Writer:
    def __init__(self, scene):
        self.scene = scene
        self.scale = max(1.0, EXTENT / size_of(scene))
        self.ambient = np.array(grey(scene.get("ambient", 0)))
        self.textures = {}  # text → name
        self.lines = []

    def at(self, point):
        return vector(np.asarray(point, float) * self.scale)

    def texture(self, shape):
        material = shape.get("material", {"diffuse": 0.8})
        text = texture(self.scene["materials"][material] if isinstance(material, str) else material, self.ambient)
        return f"texture {{ {self.textures.setdefault(text, f'T{len(self.textures)}')} }}"

    def shape(self, shape):
        kind = shape["type"]
        if kind == "group":
            if "transform" in shape:
                raise NotExpressible("transform")
            for each in shape["objects"]:
                self.shape(each)
            return
        look = self.texture(shape)
        if kind == "sphere":
            text = f"sphere {{ {self.at(shape['center'])}, {shape['radius'] * self.scale:.9g} {look} }}"
        elif kind == "triangle":
            text = f"triangle {{ {', '.join(self.at(v) for v in shape['vertices'])} {look} }}"
        elif kind == "cylinder":
            base, direction = np.array(shape["point"], float), np.array(shape["direction"], float)
            top = base + direction / np.linalg.norm(direction) * shape["height"]
            text = f"cylinder {{ {self.at(base)}, {self.at(top)}, {shape['radius'] * self.scale:.9g} open {look} }}"
        elif kind == "mesh":
            if "normals" in shape:
                raise NotExpressible("smooth normals")
            positions = np.array(shape["positions"], float).reshape(-1, 3)
            faces = np.array(shape["indices"]).reshape(-1, 3)
            text = (f"mesh2 {{ vertex_vectors {{ {len(positions)}, {','.join(map(self.at, positions))} }} face_indices "
                    f"{{ {len(faces)}, {','.join(f'<{a},{b},{c}>' for a, b, c in faces)} }} {look} }}")
        else:
            raise NotExpressible(kind)
        self.lines.append(text)

    def light(self, light, words, size):
        constant, linear, quadratic = light.get("attenuation", [1, 0, 0])
        if light["type"] != "point" or linear or constant != 1:
            raise NotExpressible("attenuation")
        intensity, fade = np.array(grey(light["intensity"]), float), ""
        if quadratic:  # 2 / (1 + (d / fade_distance)²)
            intensity, fade = intensity / 2, f"fade_power 2 fade_distance {self.scale / quadratic ** 0.5:.9g}"
        area, width = "", 2 * light.get("radius", 0) * self.scale
        if width:
            area = f"area_light <{width:.9g},0,0>, <0,{width:.9g},0>, {size}, {size} {words} circular orient"
        self.lines.append(f"light_source {{ {self.at(light['position'])}, rgb {vector(intensity)} {area} {fade} }}")

    def camera(self, camera, edge):
        position = np.array(camera["position"], float)
        forward = np.array(camera.get("direction") or np.array(camera["look_at"]) - position, float)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, camera.get("up", [0, 1, 0]))
        right /= np.linalg.norm(right)
        plane = camera.get("view_plane")
        if not plane:
            side = 2 * np.tan(np.radians(camera["vertical_fov"]) / 2)
            plane = {"width": side, "height": side, "distance": 1}
        self.lines.append(f"camera {{ perspective location {self.at(position)} direction {vector(forward * plane['distance'])} "
                          f"right {vector(right * plane['width'])} up {vector(np.cross(right, forward) * plane['height'])} }}")

    def text(self, words, size, edge):
        self.lines = []
        self.camera(self.scene["camera"], edge)
        for light in self.scene["lights"]:
            self.light(light, words, size)
        for shape in self.scene["objects"]:
            self.shape(shape)
        head = ["#version 3.7;", "global_settings { assumed_gamma 1 ambient_light 1 max_trace_level 11 adc_bailout 0.001 }",
                f"background {{ rgb {vector(grey(self.scene.get('background', 0)))} }}"]
        head += [f"#declare {name} = {text}" for text, name in self.textures.items()]
        return "\n".join(head + self.lines) + "\n"


def read_ppm(path):
    """16 bits a channel."""
    data = path.read_bytes()
    header = re.match(rb"P6\s+(?:#[^\n]*\n)*(\d+)\s+(?:#[^\n]*\n)*(\d+)\s+(?:#[^\n]*\n)*(\d+)\s", data)
    width, height, most = map(int, header.groups())
    return np.frombuffer(data[header.end():], ">u2").reshape(height, width, 3).astype(float) / most


def render(scene, words, size, threads, edge):
    """The linear image and the seconds of tracing, from POV-Ray's own report."""
    with tempfile.TemporaryDirectory() as folder:
        source, image = Path(folder) / "scene.pov", Path(folder) / "image.ppm"
        source.write_text(Writer(scene).text(words, size, edge))
        report = subprocess.run(["povray", f"+I{source}", f"+O{image}", f"+W{edge}", f"+H{edge}", "+FP16", "File_Gamma=1.0", "-A",
                                 "-D", f"+WT{threads}", "+Q9"], capture_output=True, text=True)
        if report.returncode:
            raise RuntimeError(report.stderr[-2000:])
        trace = re.search(r"Trace Time:.*?\(([\d.]+) seconds\)", report.stderr)
        return read_ppm(image), float(trace.group(1))


def variants(scene):
    """name → (budgets, render(budget, threads, edge))."""
    Writer(scene).text("", 2, 100)  # tells what cannot be expressed
    return {name: (sizes, lambda size, threads, edge, words=words: render(scene, words, size, threads, edge))
            for name, (words, sizes) in VARIANTS.items()}


def finest_budget(coarsest=None):
    return VARIANTS["povray grid"][1][:coarsest][-1]


def finest(scene, coarsest, edge):
    """The images its limit is the mean of: adaptive grids tend to something else, further from the exact image."""
    return [render(scene, VARIANTS[name][0], finest_budget(coarsest), os.cpu_count(), edge)[0]
            for name in ("povray grid", "povray jitter")]
