"""Runs inside Blender: blender -b --factory-startup -P cycles_scene.py -- JOB.json
JOB = {"scene": …, "edge", "threads", "samples", "threshold" or null, "seed", "image": where the linear pixels go}."""
import json
import sys

import bpy
import numpy as np

CONSTANT_POWER = 4 * np.pi ** 2  # of a point light whose falloff is constant: this many watts light like intensity 1


def grey(color):
    return [color] * 3 if isinstance(color, (int, float)) else list(color)


def material_for(scene, shape, made):
    description = shape.get("material", {"diffuse": 0.8})
    if isinstance(description, str):
        description = scene["materials"][description]
    key = json.dumps(description)
    if key in made:
        return made[key]
    material = made[key] = bpy.data.materials.new("matte")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    diffuse, glow, both, out, path = (nodes.new(f"ShaderNode{kind}") for kind in (
        "BsdfDiffuse", "Emission", "AddShader", "OutputMaterial", "LightPath"))
    diffuse.inputs["Color"].default_value = (*grey(description.get("diffuse", 0)), 1)
    ambient = np.array(grey(scene.get("ambient", 0))) * grey(description.get("ambient", 1))
    glow.inputs["Color"].default_value = (*(ambient + grey(description.get("emission", 0))), 1)
    links.new(path.outputs["Is Camera Ray"], glow.inputs["Strength"])  # glows for the camera only
    links.new(diffuse.outputs[0], both.inputs[0])
    links.new(glow.outputs[0], both.inputs[1])
    links.new(both.outputs[0], out.inputs["Surface"])
    material.cycles.sample_as_light = False
    return material


def add_mesh(positions, faces, material):
    mesh = bpy.data.meshes.new("mesh")
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", np.asarray(positions, np.float32).ravel())
    mesh.loops.add(3 * len(faces))
    mesh.loops.foreach_set("vertex_index", np.asarray(faces, np.int32).ravel())
    mesh.polygons.add(len(faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * len(faces), 3, dtype=np.int32))
    mesh.polygons.foreach_set("loop_total", np.full(len(faces), 3, np.int32))
    mesh.update(calc_edges=True)
    mesh.materials.append(material)
    made = bpy.data.objects.new("mesh", mesh)
    bpy.context.collection.objects.link(made)
    return made


def add_spheres(spheres, material):
    """True spheres: the points of a mesh become a point cloud with a radius each."""
    mesh = bpy.data.meshes.new("points")
    mesh.vertices.add(len(spheres))
    mesh.vertices.foreach_set("co", np.array([s["center"] for s in spheres], np.float32).ravel())
    mesh.attributes.new("size", "FLOAT", "POINT").data.foreach_set("value", np.array([s["radius"] for s in spheres], np.float32))
    made = bpy.data.objects.new("points", mesh)
    bpy.context.collection.objects.link(made)
    tree = bpy.data.node_groups.new("spheres", "GeometryNodeTree")
    tree.inputs.new("NodeSocketGeometry", "Geometry")
    tree.outputs.new("NodeSocketGeometry", "Geometry")
    source, sink = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    points, size, look = (tree.nodes.new(f"GeometryNode{kind}") for kind in ("MeshToPoints", "InputNamedAttribute", "SetMaterial"))
    size.data_type = "FLOAT"
    size.inputs["Name"].default_value = "size"
    look.inputs["Material"].default_value = material
    value = next(o for o in size.outputs if o.enabled and o.name == "Attribute")
    tree.links.new(source.outputs[0], points.inputs["Mesh"])
    tree.links.new(value, points.inputs["Radius"])
    tree.links.new(points.outputs[0], look.inputs["Geometry"])
    tree.links.new(look.outputs[0], sink.inputs[0])
    made.modifiers.new("spheres", "NODES").node_group = tree


def add_light(light):
    data = bpy.data.lights.new("light", "POINT")
    data.shadow_soft_size = light.get("radius", 0)
    data.energy = CONSTANT_POWER
    data.use_nodes = True
    nodes, links = data.node_tree.nodes, data.node_tree.links
    falloff = nodes.new("ShaderNodeLightFalloff")
    falloff.inputs["Strength"].default_value = 1
    emission = nodes["Emission"]
    emission.inputs["Color"].default_value = (*grey(light["intensity"]), 1)
    links.new(falloff.outputs["Constant"], emission.inputs["Strength"])
    made = bpy.data.objects.new("light", data)
    made.location = light["position"]
    bpy.context.collection.objects.link(made)


def add_camera(camera):
    from mathutils import Matrix, Vector
    position = Vector(camera["position"])
    forward = (Vector(camera["direction"]) if "direction" in camera else Vector(camera["look_at"]) - position).normalized()
    right = forward.cross(Vector(camera.get("up", [0, 1, 0]))).normalized()
    up = right.cross(forward)
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle = np.radians(camera["vertical_fov"])
    data.clip_start, data.clip_end = 1e-3, 1e6
    made = bpy.data.objects.new("camera", data)
    made.matrix_world = Matrix(((right.x, up.x, -forward.x, position.x), (right.y, up.y, -forward.y, position.y),
                                (right.z, up.z, -forward.z, position.z), (0, 0, 0, 1)))
    bpy.context.collection.objects.link(made)
    bpy.context.scene.camera = made


def add_world(color):
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (*grey(color), 1)
    world.cycles.sampling_method = "NONE"
    for kind in ("diffuse", "glossy", "transmission", "scatter"):
        setattr(world.cycles_visibility, kind, False)
    bpy.context.scene.world = world


def settings(job):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = job["edge"]
    scene.render.resolution_percentage = 100
    scene.render.threads_mode, scene.render.threads = "FIXED", job["threads"]
    scene.render.use_persistent_data = False
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples, cycles.seed = job["samples"], job["seed"]
    cycles.use_adaptive_sampling = job["threshold"] is not None
    cycles.adaptive_threshold = job["threshold"] or 0
    cycles.max_bounces = 0
    cycles.use_denoising = False
    cycles.use_auto_tile = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0
    cycles.pixel_filter_type, cycles.filter_width = "GAUSSIAN", 0.01  # rays through the pixels' centers
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.filepath = job["image"] + ".exr"


def main():
    job = json.load(open(sys.argv[sys.argv.index("--") + 1]))
    scene, made, spheres = job["scene"], {}, {}
    for each in list(bpy.data.objects):
        bpy.data.objects.remove(each)
    for shape in scene["objects"]:
        look = material_for(scene, shape, made)
        if shape["type"] == "sphere":
            spheres.setdefault(look.name, (look, []))[1].append(shape)
        else:
            add_mesh(np.array(shape["positions"]).reshape(-1, 3), np.array(shape["indices"]).reshape(-1, 3), look)
    for look, group in spheres.values():
        add_spheres(group, look)
    for light in scene["lights"]:
        add_light(light)
    add_camera(scene["camera"])
    add_world(scene.get("background", 0))
    settings(job)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(bpy.context.scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(4 * job["edge"] ** 2, np.float32)
    image.pixels.foreach_get(pixels)
    pixels.reshape(job["edge"], job["edge"], 4)[::-1, :, :3].tofile(job["image"])


main()
