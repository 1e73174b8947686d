# SPDX-License-Identifier: MIT OR Apache-2.0
# /// script
# requires-python = ">=3.10,<3.13"
# dependencies = ["pyluxcore==2.11.2", "numpy==1.26.4"]
#
# [tool.lookmatch]
# title = "LuxCore"
# licence = "Apache-2.0"
# about = "Unbiased path tracer of LuxCoreRender, on the processor; without its proprietary nvrtc part"
# debian = []
# pip-options = ["--no-deps"]
# ///
"""LuxCore as a renderer: engine PATHCPU, sampler SOBOL, one render session per picture.

Conventions that differ from the protocol's, and what is done about them:

- A point light of gain 4π and colour I has the radiant intensity I, once its power and efficiency are 0.
- On LuxCore's maps the azimuth runs the other way and starts elsewhere: the map is turned and mirrored here. Z is up for it.
- Pictures come from the bottom row up, and one row off: the screen window is shifted by a pixel.
- There is no sphere: a mesh of 256 by 128 with smooth normals stands in, its texture coordinates give the tangent.
- Defaults that are switched off: adaptive sampling, Russian roulette, the pixel filter. The film is read before its pipeline.
- HasDone() turns true only if UpdateStats() is called. When it stops is a matter of timing: the same
  seed gives nearly the same picture.
- It prints on standard output, from the import on, and the process aborts when the interpreter takes it down.
"""

import lookmatch_worker as worker
from lookmatch_worker import Refused, Timer, colour, number

import math
import os
import time

import numpy as np
import pyluxcore

# Light is followed to this many surfaces.
DEPTH = 5

ENGINE = {
    "renderengine.type": "PATHCPU",
    "native.threads.count": len(os.sched_getaffinity(0)),
    "path.pathdepth.total": DEPTH,
    "path.pathdepth.diffuse": DEPTH,
    "path.pathdepth.glossy": DEPTH,
    "path.pathdepth.specular": DEPTH,
    "path.russianroulette.depth": 1000,
    "path.clamping.variance.maxvalue": 0.0,
    "path.hybridbackforward.enable": False,
    "sampler.type": "SOBOL",
    "sampler.sobol.adaptive.strength": 0.0,
    "film.filter.type": "NONE",
    "film.noiseestimation.warmup": 1 << 30,
    "film.outputs.1.type": "RGB",
    "film.outputs.1.filename": "unused.exr",
}


def properties(values):
    result = pyluxcore.Properties()
    for name, value in values.items():
        result.Set(pyluxcore.Property(name, value))
    return result


def ball_mesh(centre, radius, around=256, rows=128):
    """Points, triangles, normals and texture coordinates; u runs eastwards, v northwards."""
    # A column of points is doubled where u ends, and the poles are rows of points.
    azimuth, polar = np.meshgrid(np.linspace(0, 2 * np.pi, around + 1), np.linspace(0, np.pi, rows + 1))
    normals = np.stack([np.sin(polar) * np.sin(azimuth), np.cos(polar), np.sin(polar) * np.cos(azimuth)], axis=2)
    points = np.asarray(centre) + radius * normals
    coordinates = np.stack([azimuth / (2 * np.pi), 1 - polar / np.pi], axis=2)
    index = np.arange((around + 1) * (rows + 1)).reshape(rows + 1, around + 1)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.concatenate([np.stack([a, b, c], 2)[:-1].reshape(-1, 3), np.stack([a, c, d], 2)[1:].reshape(-1, 3)])
    return [list(map(tuple, x.reshape(-1, x.shape[-1]).tolist())) for x in (points, triangles, normals, coordinates)]


def define_ground(scene, plane):
    half, y, check = plane["half_extent"], plane["height"], plane["check_size"]
    corners = [(-half, -half), (-half, half), (half, half), (half, -half)]
    scene.DefineMesh(
        "ground", [(x, y, z) for x, z in corners], [(0, 1, 2), (0, 2, 3)], None,
        [(x / check, z / check) for x, z in corners], None, None,
    )  # fmt: skip
    return {
        "scene.textures.checks.type": "checkerboard2d",
        "scene.textures.checks.texture1": plane["light"],
        "scene.textures.checks.texture2": plane["dark"],
        "scene.materials.floor.type": "matte",
        "scene.materials.floor.kd": "checks",
        "scene.objects.ground.shape": "ground",
        "scene.objects.ground.material": "floor",
    }


def point_light(light, index):
    name = f"scene.lights.lamp{index}."
    return {
        name + "type": "point",
        name + "position": light["position"],
        name + "color": light["intensity"],
        name + "gain": [4 * math.pi] * 3,
        name + "power": 0.0,
        name + "efficency": 0.0,
        name + "normalizebycolor": False,
    }


def define_sky(scene, environment):
    # Mirrored, then turned by a quarter.
    height, width, _ = environment.shape
    if width % 4:
        environment = environment.repeat(4, axis=1)
        width *= 4
    turned = np.roll(environment[:, ::-1], width // 4, axis=1)
    scene.DefineImageMap("map", np.ascontiguousarray(turned, np.float32).ravel(), 1.0, 3, width, height)
    return {
        "scene.lights.sky.type": "infinite",
        "scene.lights.sky.file": "map",
        "scene.lights.sky.gamma": 1.0,
        "scene.lights.sky.gain": [1.0, 1.0, 1.0],
        # LuxCore's maps have their pole at +Z; this turns it to +Y.
        "scene.lights.sky.transformation": [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1],
        "scene.lights.sky.visibilitymapcache.enable": False,
    }


def camera(view, size):
    row = 2 / size
    return {
        "scene.camera.type": "perspective",
        "scene.camera.lookat.orig": view["eye"],
        "scene.camera.lookat.target": view["target"],
        "scene.camera.up": view["up"],
        "scene.camera.fieldofview": view["vertical_fov"],
        "scene.camera.screenwindow": [-1.0, 1.0, -1.0 - row, 1.0 - row],
        "scene.camera.lensradius": 0.0,
        "scene.camera.autofocus.enable": False,
    }


def roughness(name, **more):
    levels = {"search": (0.01, 0.69, 0.01), "survey": (0.03, 0.67, 0.08)}
    return number(name, "roughness", 0.2, (0.001, 1.0), **levels, **more)


def share(name, role, default, **more):
    return number(name, role, default, (0.0, 1.0), search=(0.0, 1.0, 0.02), survey=(0.0, 1.0, 0.125), **more)


BODY = [0.5, 0.5, 0.5]
WIDTHS = [
    roughness("uroughness", summary="α, eastwards where there are two."),
    number("vroughness", "lobe-shape", 0.0, (0.0, 1.0), summary="α northwards; 0 stands for that of uroughness."),
]
METAL = [
    colour("n", "conductor-index", [1.5, 0.98, 0.6], (0.0, 10.0, "open")),
    colour("k", "extinction", [7.5, 6.5, 5.5], (0.0, 20.0)),
]


def model(name, title, summary, fresnel, surveyed, *parameters):
    return {
        "name": name,
        "title": title,
        "summary": summary,
        "has_fresnel": fresnel,
        "parameters": list(parameters),
        "surveyed": surveyed,
        "searched": surveyed,
    }


MODELS = [
    model("matte", "Matte", "Lambert.", False, ["kd"], colour("kd", "diffuse-reflectance", BODY)),
    model(
        "roughmatte", "Rough matte", "Oren-Nayar.", False, ["sigma"],
        colour("kd", "diffuse-reflectance", BODY),
        number("sigma", "diffuse-roughness", 0.35, (0.0, 1.5), unit="rad", search=(0.0, 1.0, 0.02), survey=(0.0, 1.0, 0.125)),
    ),
    model(
        "glossy2", "Glossy", "Schlick's coating, a GGX-like lobe, above a body that gets what it lets through.",
        True, ["ks", "uroughness"],
        colour("kd", "base-colour", BODY),
        colour("ks", "normal-reflectance", [0.05, 0.05, 0.05], search=(0.0, 0.4, 0.01), survey=(0.0, 0.4, 0.05)),
        *WIDTHS,
    ),
    model(
        "metal2", "Metal", "Rough conductor, a GGX-like lobe, by index and extinction.", True, ["uroughness"], *METAL, *WIDTHS,
    ),
    model(
        "mattemix", "Matte and metal", "Mix of matte and metal2; amount is the share of metal2.",
        True, ["amount", "uroughness"],
        colour("kd", "base-colour", BODY, summary="Albedo of the matte part, of which the mix leaves 1 − amount."),
        share("amount", "specular-reflectance", 0.2), *METAL, *WIDTHS,
    ),
    model(
        "disney", "Disney", "Disney's principled material of 2012.", True, ["specular", "roughness"],
        colour("basecolor", "base-colour", BODY),
        number("roughness", "perceptual-roughness", 0.4, (0.0, 1.0), search=(0.05, 0.85, 0.01), survey=(0.1, 0.82, 0.09)),
        share("metallic", "metalness", 0.0),
        share("specular", "specular-level", 0.5),
        share("speculartint", "lobe-shape", 0.0),
        share("clearcoat", "coat", 0.0),
        share("clearcoatgloss", "lobe-shape", 1.0),
        share("anisotropic", "anisotropy", 0.0),
        share("sheen", "sheen", 0.0),
        share("sheentint", "lobe-shape", 0.0),
    ),
    model("mirror", "Mirror", "Reflects by the colour kr.", False, ["kr"], colour("kr", "specular-reflectance", [1.0, 1.0, 1.0])),
]  # fmt: skip


def describe(name, values):
    """The properties that define the material `subject`."""
    values = dict(values)
    if "vroughness" in values:
        values["vroughness"] = values["vroughness"] or values["uroughness"]
    if name == "mattemix":
        return {
            "scene.materials.body.type": "matte",
            "scene.materials.body.kd": values.pop("kd"),
            "scene.materials.shine.type": "metal2",
            **{f"scene.materials.shine.{key}": value for key, value in values.items() if key != "amount"},
            "scene.materials.subject.type": "mix",
            "scene.materials.subject.material1": "body",
            "scene.materials.subject.material2": "shine",
            "scene.materials.subject.amount": values["amount"],
        }
    fixed = {"subsurface": 0.0} if name == "disney" else {}
    described = {"type": name, **values, **fixed}
    return {f"scene.materials.subject.{key}": value for key, value in described.items()}


class LuxCore:
    def __init__(self):
        pyluxcore.Init(lambda message: None)
        self.scenes = {}
        self.current = None

    def hello(self):
        return {
            "name": "luxcore",
            "version": pyluxcore.Version(),
            "licence": "Apache-2.0",
            "models": MODELS,
            "capabilities": {
                "deterministic": "approximate",
                "seeds": True,
                "noise": True,
                "samples": "one path per pixel",
                "lights": ["point", "environment"],
                "threads": "all",
                "cancel": True,
                "interreflection": True,
            },
            "check": {
                "lambert": {"model": "matte", "values": {}, "parameter": "kd"},
                "mirror": {"model": "mirror", "values": {"kr": [1.0, 1.0, 1.0]}},
            },
            "approximations": [
                "Spheres are meshes of 256 by 128 with smooth normals.",
                f"Light is followed to {DEPTH} surfaces.",
                "metal2: LuxCore's Fresnel term is exact at normal incidence; at 24° it was found 3 % low for n 1.5, k 7.5.",
                "disney: LuxCore multiplies by the cosine of the light once more than Burley where it samples a light, not where it "
                "samples the material: point lights fall off too fast, and under a map the picture lies between.",
            ],
        }

    def scene(self, name, scene, environment):
        made = pyluxcore.Scene()
        described = {"scene.materials.subject.type": "matte", **camera(scene["camera"], scene["size"])}
        made.Parse(properties(described))
        described = {}
        for i, ball in enumerate(scene["spheres"]):
            points, triangles, normals, coordinates = ball_mesh(ball["centre"], ball["radius"])
            made.DefineMesh(f"ball{i}", points, triangles, normals, coordinates, None, None)
            described[f"scene.objects.ball{i}.shape"] = f"ball{i}"
            described[f"scene.objects.ball{i}.material"] = "subject"
        if scene["plane"] is not None:
            described |= define_ground(made, scene["plane"])
        for i, light in enumerate(scene["point_lights"]):
            described |= point_light(light, i)
        if environment is not None:
            described |= define_sky(made, environment)
        made.Parse(properties(described))
        self.scenes[name] = made, scene["size"]

    def material(self, model, values):
        if model not in (each["name"] for each in MODELS):
            raise Refused(f"unknown model '{model}'; known are {', '.join(each['name'] for each in MODELS)}")
        self.current = describe(model, values)

    def render(self, name, samples, seed):
        if self.current is None or name not in self.scenes:
            raise Refused("render needs a scene and a material first")
        scene, size = self.scenes[name]
        film = {"film.width": size, "film.height": size, "batch.haltspp": samples, "renderengine.seed": seed + 1}
        with Timer() as timer:
            scene.Parse(properties(self.current))
            session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties({**ENGINE, **film}), scene))
            session.Start()
            try:
                taken = wait(session)
            finally:
                session.Stop()
            pixels = np.empty(size * size * 3, np.float32)
            session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB, pixels, 0)
        return pixels.reshape(size, size, 3)[::-1], {"samples": taken, **timer.info}


def wait(session):
    """Until the session has enough samples; gives how many it has."""
    while True:
        session.UpdateStats()
        if session.HasDone():
            return int(session.GetStats().Get("stats.renderengine.pass").GetInt())
        if worker.cancelled.is_set():
            raise Refused("cancelled")
        time.sleep(0.01)


if __name__ == "__main__":
    worker.serve(LuxCore())
