"""A scene of lookmatch for Blender 4.2 to 5 (Cycles).

    blender --background --python scene.py -- [SAMPLES]        or, with the package bpy,  python scene.py [SAMPLES]

builds the scene and renders full_point.exr, full_environment.exr, diffuse_point.exr and diffuse_environment.exr beside this
file. Numbers below are in the scene's own coordinates (Y up); `blender` turns them into Blender's (Z up).
"""

import json
import math
import pathlib
import sys

import bpy
from mathutils import Matrix, Vector

SCENE = json.loads(r"""@SCENE@""")


def full_material(material, colour):
    """EDIT HERE: your material. As it stands, a Principled BSDF of the given body colour (linear RGB)."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    bsdf = nodes.new("ShaderNodeBsdfPrincipled")
    bsdf.inputs["Base Color"].default_value = (*colour, 1.0)
    bsdf.inputs["Roughness"].default_value = 0.3
    links.new(bsdf.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])


def diffuse_material(material, colour):
    """EDIT HERE: the diffuse reflection alone. Under a coat no node makes it: delete the two diffuse pictures then."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    bsdf = nodes.new("ShaderNodeBsdfDiffuse")
    bsdf.inputs["Color"].default_value = (*colour, 1.0)
    links.new(bsdf.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])


def blender(v):
    """A vector of the scene in Blender's coordinates."""
    return Vector((v[0], -v[2], v[1]))


def link(name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def new_material(name):
    material = bpy.data.materials.new(name)
    if not material.node_tree:
        material.use_nodes = True
    return material


def set_subjects(build):
    """Gives the materials of the subjects the nodes that `build` makes."""
    for name, colour in SCENE["subjects"]:
        material = bpy.data.materials[name]
        material.node_tree.nodes.clear()
        build(material, colour)


def add_camera():
    camera = bpy.data.cameras.new("camera")
    camera.sensor_width = camera.sensor_height = 36.0
    camera.lens = 36.0 * SCENE["focal_length"]
    camera.clip_start, camera.clip_end = 0.001, 10000.0
    thing = link("camera", camera)
    axes = [blender(axis) for axis in SCENE["camera_axes"]]
    thing.matrix_world = Matrix.Translation(blender(SCENE["eye"])) @ Matrix(axes).transposed().to_4x4()
    bpy.context.scene.camera = thing


def add_spheres():
    for name, _ in SCENE["subjects"]:
        new_material(name)
    for number, sphere in enumerate(SCENE["spheres"], 1):
        segments = SCENE["segments"]
        bpy.ops.mesh.primitive_uv_sphere_add(
            segments=segments, ring_count=segments // 2, radius=sphere["radius"], location=blender(sphere["centre"])
        )
        thing = bpy.context.object
        thing.name = f"sphere{number}"
        for polygon in thing.data.polygons:
            polygon.use_smooth = True
        thing.data.materials.append(bpy.data.materials[sphere["material"]])


def add_board():
    plane = SCENE["plane"]
    if not plane:
        return
    half, check, height = plane["half_extent"], plane["check_size"], plane["height"]
    last = math.floor(half / check * (1 - 1e-9))
    lines = [-half, *(k * check for k in range(-last, last + 1)), half]
    corners = [blender((x, height, z)) for x in lines for z in lines]
    faces, dark = [], []
    rows = len(lines)
    for i in range(rows - 1):
        for k in range(rows - 1):
            faces.append((i * rows + k, i * rows + k + 1, (i + 1) * rows + k + 1, (i + 1) * rows + k))
            x, z = lines[i] + lines[i + 1], lines[k] + lines[k + 1]
            dark.append((math.floor(x / 2 / check) + math.floor(z / 2 / check)) % 2)
    mesh = bpy.data.meshes.new("board")
    mesh.from_pydata(corners, [], faces)
    for name in "light", "dark":
        material = new_material(f"check_{name}")
        material.node_tree.nodes.clear()
        diffuse_material(material, plane[name])
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", dark)
    link("board", mesh)


def add_point_lights():
    for number, light in enumerate(SCENE["point_lights"], 1):
        strength = max(light["intensity"])
        lamp = bpy.data.lights.new(f"point{number}", "POINT")
        # Blender's watts are those of the whole lamp.
        lamp.energy = 4 * math.pi * strength
        lamp.color = [v / strength if strength > 0 else 0 for v in light["intensity"]]
        lamp.shadow_soft_size = 0.0
        if hasattr(lamp, "use_soft_falloff"):
            lamp.use_soft_falloff = False
        link(lamp.name, lamp).location = blender(light["position"])


def set_world(folder, light):
    """The environment, or black."""
    world = bpy.data.worlds.new(light)
    if not world.node_tree:
        world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    nodes.clear()
    background = nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    links.new(background.outputs[0], nodes.new("ShaderNodeOutputWorld").inputs["Surface"])
    if light == "environment":
        image = bpy.data.images.load(str(folder / SCENE["environment"]), check_existing=True)
        texture, mapping = nodes.new("ShaderNodeTexEnvironment"), nodes.new("ShaderNodeMapping")
        texture.image = image
        # Cycles' own map starts a quarter turn elsewhere.
        mapping.inputs["Rotation"].default_value = (0, 0, math.pi / 2 + math.radians(SCENE["rotation"]))
        coordinates = nodes.new("ShaderNodeTexCoord")
        links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
        links.new(mapping.outputs[0], texture.inputs["Vector"])
        links.new(texture.outputs[0], background.inputs["Color"])
        world.cycles.sampling_method = "MANUAL"
        world.cycles.sample_map_resolution = 1024
    bpy.context.scene.world = world


def set_light(folder, light):
    """Turns on the point lights or the environment, and the other off."""
    for thing in bpy.context.scene.objects:
        if thing.type == "LIGHT":
            thing.hide_render = light != "point"
    set_world(folder, light)


def set_renderer(samples):
    """Everything that Blender does to please the eye is off."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = SCENE["size"]
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = False
    scene.render.use_compositing = scene.render.use_sequencer = False
    cycles = scene.cycles
    cycles.samples = samples
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 32
    scene.view_settings.view_transform = "Raw"
    scene.view_settings.exposure, scene.view_settings.gamma = 0.0, 1.0
    output = scene.render.image_settings
    output.file_format = "OPEN_EXR"
    output.color_mode, output.color_depth, output.exr_codec = "RGB", "32", "ZIP"


def build(folder):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    add_camera()
    add_spheres()
    add_board()
    add_point_lights()
    set_renderer(256)
    set_subjects(full_material)
    set_light(folder, "environment")


def render(folder, samples):
    set_renderer(samples)
    for part, nodes in ("full", full_material), ("diffuse", diffuse_material):
        set_subjects(nodes)
        for light in "point", "environment":
            set_light(folder, light)
            bpy.context.scene.render.filepath = str(folder / f"{part}_{light}.exr")
            bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    here = pathlib.Path(__file__).resolve().parent
    build(here)
    if bpy.app.background:
        arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
        render(here, int(arguments[0]) if arguments else 256)
