# /// script
# requires-python = "==3.11.*"
# dependencies = ["bpy==5.0.1", "numpy==1.26.4"]
# [tool.lookmatch]
# title = "Blender Cycles"
# licence = "GPL-3.0-or-later"
# about = "The path tracer of Blender, on the CPU, with its Principled, Glossy, Metallic and Diffuse materials"
# debian = ["libx11-6", "libxext6", "libxrender1", "libxfixes3", "libxi6", "libxkbcommon0", "libsm6", "libice6", "libgl1"]
# ///
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Blender Cycles as a worker of the renderer protocol (docs/renderer-protocol.md).

Axes        Blender's (X, Y, Z) are the scene's (z, x, y): a rotation. Z is up as Blender likes it, and Cycles' latitude-longitude
            map then lies as the protocol's does; only its rows run the other way.
Lights      Blender's power of a point light is P = 4 pi I. Its radius is 0.
Map         float pixels without a colour space, interpolated linearly between the middles of texels. It is sampled by
            importance from a table of its own size.
Spheres     are points of a point cloud, which Cycles intersects exactly. Their tangent is Z x normal: eastwards.
Roughness   of every node is the root of the microfacet alpha; masking is Smith's, height-correlated for GGX. Add Shader is a
            plain sum. Anisotropy of Glossy and Metallic narrows the lobe along the tangent (above 0); that of Principled
            widens it there.
Picture     denoiser, adaptive sampling, clamps, blurred glossy paths, light threshold and tone mapping are off, caustics on,
            the pixel filter is a box. Rendered pixels cannot be read without a display: they go through an uncompressed
            32-bit EXR file, in memory where there is /dev/shm.

Traps       `persistent_data` saves 30 ms per picture. It keeps what was exported by the scene's *name*, so that no name is used
            twice, and the table of quasi-random numbers of the first number of samples: see `Scene.render`. bpy holds the
            interpreter while it renders, so neither progress nor a cancel is possible.
"""

import itertools
import math
import os
import sys
import tempfile

from lookmatch_worker import Refused, Timer, choice, colour, number, serve

# Blender's add-on is called `cycles`, too: it must not find this file.
sys.path = [folder for folder in sys.path if os.path.realpath(folder) != os.path.dirname(os.path.realpath(__file__))]

import bpy
import numpy as np
from mathutils import Matrix, Vector

# Blender prints "Saved: ..." after every picture; what goes wrong is written to standard error.
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)

# After the camera ray. Cycles ends paths at random before, without bias.
BOUNCES = 12

ROUGHNESS = {"search": (0.05, 0.85, 0.01), "survey": (0.1, 0.8, 0.1)}
INDEX = {"search": (1.01, 2.5, 0.01), "survey": (1.2, 2.2, 0.2)}
SHARE = {"search": (0.0, 1.0, 0.02), "survey": (0.0, 1.0, 0.2)}


def roughness(name, role="perceptual-roughness", default=0.5, **more):
    return number(name, role, default, (0.0, 1.0), **ROUGHNESS, **more)


def share(name, role, default=0.0, **more):
    return number(name, role, default, (0.0, 1.0), **SHARE, **more)


def index(name, role="refractive-index", default=1.5, **more):
    return number(name, role, default, (1.0, 100.0), **INDEX, **more)


def tint(name, role, default, **more):
    return colour(name, role, [default] * 3, **SHARE, **more)


ANISOTROPY = number(
    "anisotropy",
    "anisotropy",
    0.0,
    (-0.99, 0.99),
    search=(-0.9, 0.9, 0.05),
    survey=(-0.8, 0.8, 0.4),
    summary="Above 0 the lobe is narrow along the tangent: alpha (1 - a) there, alpha / (1 - a) across.",
)

GLOSSY = [
    tint("color", "specular-reflectance", 0.8, summary="Reflectance; there is no Fresnel term."),
    roughness("roughness"),
    ANISOTROPY,
    choice("distribution", ["GGX", "BECKMANN", "ASHIKHMIN_SHIRLEY", "MULTI_GGX"], role="lobe-shape"),
]

MODELS = [
    {
        "name": "principled",
        "title": "Principled BSDF",
        "summary": "Layered material: plastic, metal, clear coat and sheen.",
        "reference": "Blender 5.0, Principled BSDF v2",
        "has_fresnel": True,
        "parameters": [
            tint("base_color", "base-colour", 0.8),
            share("metallic", "metalness"),
            roughness("roughness"),
            index("ior"),
            share("diffuse_roughness", "diffuse-roughness"),
            share("specular_ior_level", "specular-level", 0.5, summary="F0 as a multiple of twice that of `ior`."),
            tint("specular_tint", "specular-colour", 1.0),
            share("anisotropic", "anisotropy"),
            share("coat_weight", "coat"),
            roughness("coat_roughness", "coat-roughness", 0.03),
            index("coat_ior", "coat-index"),
            tint("coat_tint", "coat-colour", 1.0),
            share("sheen_weight", "sheen"),
            roughness("sheen_roughness", "sheen-roughness"),
            tint("sheen_tint", "sheen-colour", 1.0),
            choice("distribution", ["MULTI_GGX", "GGX"]),
        ],
        "surveyed": ["ior", "roughness"],
        "searched": ["ior", "roughness"],
    },
    {
        "name": "glossy",
        "title": "Glossy BSDF",
        "summary": "Microfacets without Fresnel effect.",
        "reference": "Blender 5.0, Glossy BSDF",
        "has_fresnel": False,
        "parameters": GLOSSY,
        "surveyed": ["roughness"],
        "searched": ["color", "roughness"],
    },
    {
        "name": "glossy_diffuse",
        "title": "Glossy BSDF + Diffuse BSDF",
        "summary": "Sum of both: the diffuse reflection loses nothing to the glossy one.",
        "reference": "Blender 5.0, Add Shader",
        "has_fresnel": False,
        "parameters": [tint("diffuse_color", "diffuse-reflectance", 0.5), *GLOSSY],
        "surveyed": ["color", "roughness"],
        "searched": ["color", "roughness"],
    },
    {
        "name": "metallic",
        "title": "Metallic BSDF",
        "summary": "Microfacets with the Fresnel reflectance of a conductor.",
        "reference": "Blender 5.0, Metallic BSDF, physical conductor",
        "has_fresnel": True,
        "parameters": [
            colour("ior", "conductor-index", [2.757, 2.513, 2.231], (0.0, 100.0), search=(0.1, 5.0, 0.1)),
            colour("extinction", "extinction", [3.867, 3.404, 3.009], (0.0, 100.0), search=(0.0, 10.0, 0.1)),
            roughness("roughness"),
            ANISOTROPY,
            choice("distribution", ["MULTI_GGX", "GGX", "BECKMANN"], role="lobe-shape"),
        ],
        "surveyed": ["roughness"],
        "searched": ["roughness"],
    },
    {
        "name": "diffuse",
        "title": "Diffuse BSDF",
        "summary": "Lambertian; Oren-Nayar where it is rough.",
        "reference": "Blender 5.0, Diffuse BSDF",
        "has_fresnel": False,
        "parameters": [tint("color", "base-colour", 0.8), share("roughness", "diffuse-roughness")],
        "surveyed": ["color", "roughness"],
        "searched": ["color", "roughness"],
    },
]


class Material:
    """All models as nodes of one material; its output is linked to the one that is worn."""

    def __init__(self):
        self.data = bpy.data.materials.new("material")
        self.tree = self.data.node_tree
        self.tree.nodes.clear()
        self.output = self.add("OutputMaterial").inputs["Surface"]
        self.eastwards = self.tangent()
        self.nodes = {
            "principled": self.reflector("Principled"),
            "glossy": self.reflector("Anisotropic"),
            "glossy_diffuse": self.reflector("Anisotropic"),
            "metallic": self.reflector("Metallic"),
            "diffuse": self.reflector("Diffuse"),
        }
        self.nodes["metallic"].fresnel_type = "PHYSICAL_CONDUCTOR"
        self.surfaces = {name: node.outputs[0] for name, node in self.nodes.items()}
        self.below = self.reflector("Diffuse")
        both = self.add("AddShader")
        self.tree.links.new(self.surfaces["glossy_diffuse"], both.inputs[0])
        self.tree.links.new(self.below.outputs[0], both.inputs[1])
        self.surfaces["glossy_diffuse"] = both.outputs[0]

    def add(self, kind):
        return self.tree.nodes.new("ShaderNode" + kind)

    def tangent(self):
        """Z x normal. Blender's own Tangent node wants coordinates that a point cloud does not have."""
        normal, cross = self.add("NewGeometry"), self.add("VectorMath")
        cross.operation = "CROSS_PRODUCT"
        cross.inputs[0].default_value = 0, 0, 1
        self.tree.links.new(normal.outputs["Normal"], cross.inputs[1])
        return cross.outputs["Vector"]

    def reflector(self, kind):
        node = self.add("Bsdf" + kind)
        if "Tangent" in node.inputs:
            self.tree.links.new(self.eastwards, node.inputs["Tangent"])
        return node

    def wear(self, model, values):
        if model not in self.nodes:
            raise Refused(f"unknown model '{model}'; known are {', '.join(self.nodes)}")
        for name, value in values.items():
            self.set(self.nodes[model], name, value)
        self.tree.links.new(self.surfaces[model], self.output)

    def set(self, node, name, value):
        if name == "distribution":
            node.distribution = value
        elif name == "diffuse_color":
            self.set(self.below, "color", value)
        else:
            socket = node.inputs[socket_name(name)]
            socket.default_value = [*value, 1] if socket.type == "RGBA" else value


def socket_name(parameter):
    """`specular_ior_level` is Specular IOR Level."""
    return " ".join("IOR" if word == "ior" else word.capitalize() for word in parameter.split("_"))


def blender(position):
    """The scene's axes to Blender's."""
    x, y, z = position
    return z, x, y


def sphere_nodes(material):
    """Geometry nodes that turn vertices into points of the radius that the mesh's attribute says, with the material on."""
    tree = bpy.data.node_groups.new("spheres", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    kinds = ("NodeGroupInput", "GeometryNodeMeshToPoints", "GeometryNodeSetMaterial", "NodeGroupOutput")
    chain = [tree.nodes.new(kind) for kind in kinds]
    for first, second in itertools.pairwise(chain):
        tree.links.new(first.outputs[0], second.inputs[0])
    radius = tree.nodes.new("GeometryNodeInputNamedAttribute")
    radius.data_type = "FLOAT"
    radius.inputs["Name"].default_value = "radius"
    tree.links.new(radius.outputs["Attribute"], chain[1].inputs["Radius"])
    chain[2].inputs["Material"].default_value = material
    return tree


class Scene:
    """A scene of Blender's and all that belongs to it alone."""

    def __init__(self, name, scene, environment, spheres):
        self.owned = []
        self.size = scene["size"]
        self.data = bpy.data.scenes.new(name)
        self.settings()
        self.camera(scene["camera"])
        self.spheres(scene["spheres"], spheres)
        if scene["plane"] is not None:
            self.plane(scene["plane"])
        for light in scene["point_lights"]:
            self.point_light(light)
        self.world(environment)

    def render(self, samples, seed, path):
        render, cycles = self.data.render, self.data.cycles
        if samples != cycles.samples:
            # Else the table of quasi-random numbers stays that of the last number of samples.
            render.use_persistent_data = False
            render.use_persistent_data = True
        cycles.samples, cycles.seed, render.filepath = samples, seed, path
        bpy.ops.render.render(write_still=True, scene=self.data.name)

    def remove(self):
        bpy.data.batch_remove([self.data, *self.owned])

    def own(self, data):
        self.owned.append(data)
        return data

    def add(self, name, data):
        thing = self.own(bpy.data.objects.new(name, self.own(data)))
        self.data.collection.objects.link(thing)
        return thing

    def settings(self):
        render, cycles = self.data.render, self.data.cycles
        render.engine = "CYCLES"
        render.resolution_x = render.resolution_y = self.size
        render.use_compositing = render.use_sequencer = False
        render.dither_intensity = 0
        image = render.image_settings
        image.file_format, image.color_mode, image.color_depth, image.exr_codec = "OPEN_EXR", "RGB", "32", "NONE"
        self.data.view_settings.view_transform = "Raw"
        cycles.device = "CPU"
        cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_auto_tile = False
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
        cycles.blur_glossy = cycles.light_sampling_threshold = 0
        cycles.caustics_reflective = cycles.caustics_refractive = True
        cycles.pixel_filter_type = "BOX"
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = BOUNCES

    def camera(self, camera):
        data = bpy.data.cameras.new("camera")
        data.sensor_fit = "VERTICAL"
        data.angle = math.radians(camera["vertical_fov"])
        # Everything is in view that float32 can tell apart.
        data.clip_start, data.clip_end = 1e-4, 1e6
        eye, target, up = (Vector(blender(camera[key])) for key in ("eye", "target", "up"))
        back = (eye - target).normalized()
        right = up.cross(back).normalized()
        thing = self.add("camera", data)
        thing.matrix_world = Matrix.Translation(eye) @ Matrix((right, back.cross(right), back)).transposed().to_4x4()
        self.data.camera = thing

    def spheres(self, spheres, nodes):
        mesh = bpy.data.meshes.new("spheres")
        mesh.from_pydata([blender(sphere["centre"]) for sphere in spheres], [], [])
        mesh.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", [sphere["radius"] for sphere in spheres])
        self.add("spheres", mesh).modifiers.new("spheres", "NODES").node_group = nodes

    def plane(self, plane):
        half, height = plane["half_extent"], plane["height"]
        corners = [(-half, -half, height), (half, -half, height), (half, half, height), (-half, half, height)]
        mesh = bpy.data.meshes.new("plane")
        mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
        mesh.materials.append(self.checkerboard(plane))
        self.add("plane", mesh)

    def checkerboard(self, plane):
        material = self.own(bpy.data.materials.new("checkerboard"))
        tree = material.node_tree
        tree.nodes.clear()
        kinds = ("NewGeometry", "VectorMath", "TexChecker", "BsdfDiffuse", "OutputMaterial")
        position, flat, checker, diffuse, output = (tree.nodes.new("ShaderNode" + kind) for kind in kinds)
        # The checker's third dimension is taken out. At even cells it shows its second colour.
        flat.operation = "MULTIPLY"
        flat.inputs[1].default_value = 1, 1, 0
        checker.inputs["Scale"].default_value = 1 / plane["check_size"]
        checker.inputs["Color1"].default_value = [*plane["dark"], 1]
        checker.inputs["Color2"].default_value = [*plane["light"], 1]
        tree.links.new(position.outputs["Position"], flat.inputs[0])
        tree.links.new(flat.outputs["Vector"], checker.inputs["Vector"])
        tree.links.new(checker.outputs["Color"], diffuse.inputs["Color"])
        tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
        return material

    def point_light(self, light):
        data = bpy.data.lights.new("light", "POINT")
        strongest = max(light["intensity"]) or 1
        data.energy = 4 * math.pi * strongest
        data.color = [channel / strongest for channel in light["intensity"]]
        data.shadow_soft_size = 0
        data.use_soft_falloff = False
        self.add("light", data).location = blender(light["position"])

    def world(self, environment):
        world = self.data.world = self.own(bpy.data.worlds.new("world"))
        tree = world.node_tree
        tree.nodes.clear()
        background, output = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeOutputWorld")
        background.inputs["Color"].default_value = 0, 0, 0, 1
        tree.links.new(background.outputs[0], output.inputs["Surface"])
        world.cycles.sampling_method = "NONE"
        if environment is not None:
            texture = tree.nodes.new("ShaderNodeTexEnvironment")
            texture.image = self.image(environment)
            texture.interpolation = "Linear"
            tree.links.new(texture.outputs["Color"], background.inputs["Color"])
            world.cycles.sampling_method = "MANUAL"
            world.cycles.sample_map_resolution = environment.shape[1]

    def image(self, environment):
        height, width, _ = environment.shape
        image = self.own(bpy.data.images.new("environment", width, height, float_buffer=True, is_data=True))
        image.use_half_precision = False
        pixels = np.ones((height, width, 4), np.float32)
        pixels[..., :3] = environment[::-1]
        image.pixels.foreach_set(pixels.ravel())
        image.update()
        return image


def read_exr(path, size):
    """Pixels of Blender's picture, row 0 on top."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.is_data = True
    pixels = np.empty(size * size * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(size, size, 4)[::-1, :, :3]


class Cycles:
    def __init__(self):
        # What a user has set up for Blender must not matter.
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.worn = Material()
        self.sphere_nodes = sphere_nodes(self.worn.data)
        self.scenes = {}
        self.names = (f"scene{count}" for count in itertools.count())
        folder = "/dev/shm" if os.access("/dev/shm", os.W_OK) else tempfile.gettempdir()
        self.path = os.path.join(folder, f"lookmatch-cycles-{os.getpid()}.exr")

    def hello(self):
        return {
            "name": "cycles",
            "version": bpy.app.version_string,
            "licence": "GPL-3.0-or-later",
            "models": MODELS,
            "capabilities": {
                "deterministic": "exact",
                "seeds": True,
                "noise": True,
                "samples": "paths per pixel; powers of two are spread best",
                "lights": ["point", "environment"],
                "threads": "all",
                "cancel": False,
                "interreflection": True,
            },
            "check": {
                "lambert": {"model": "diffuse", "values": {"roughness": 0.0}, "parameter": "color"},
                "mirror": {
                    "model": "glossy",
                    "values": {"color": [1.0, 1.0, 1.0], "roughness": 0.0, "anisotropy": 0.0, "distribution": "GGX"},
                },
            },
            "approximations": [],
        }

    def scene(self, name, scene, environment):
        if not 0.37 < scene["camera"]["vertical_fov"] < 172.8:
            raise Refused("vertical_fov: Blender takes 0.37 to 172.8 degrees")
        if scene["size"] < 4:
            raise Refused("size: Blender takes 4 pixels or more")
        loaded = Scene(next(self.names), scene, environment, self.sphere_nodes)
        if name in self.scenes:
            self.scenes[name].remove()
        self.scenes[name] = loaded

    def material(self, model, values):
        self.worn.wear(model, values)

    def render(self, name, samples, seed):
        if name not in self.scenes:
            raise Refused(f"unknown scene '{name}'; known are {', '.join(self.scenes)}")
        scene = self.scenes[name]
        with Timer() as timer:
            scene.render(samples, seed, self.path)
            pixels = read_exr(self.path, scene.size)
        os.remove(self.path)
        return pixels, {"samples": scene.data.cycles.samples, **timer.info}


serve(Cycles())
