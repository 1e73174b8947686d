# SPDX-License-Identifier: MIT OR Apache-2.0
# /// script
# requires-python = ">=3.10,<3.13"
# dependencies = ["OpenEXR==3.5.3", "numpy==1.26.4"]
#
# [tool.lookmatch]
# title = "POV-Ray"
# licence = "AGPL-3.0-or-later"
# about = "The ray tracer of the nineties with its finishes phong and specular, under point lights; Debian's povray"
# debian = ["povray"]
# pip-options = []
# ///
"""POV-Ray as a renderer: a scene description and a process for each picture.

Conventions that differ from the protocol's, and what is done about them:

- Lights do not fall off with distance unless asked. With `fade_distance` f and `fade_power` 2 they do by 2 / (1 + (d/f)²), which for a
  tiny f is 2 f² / d². A white diffuse surface returns the light's colour without 1/π: the colour is I / (2 π f²).
- The frame is left-handed; `right -x` makes it right-handed.
- Highlights are not normalised and have no cosine: `phong` p returns p / π · (r·l)^phong_size of I / d², `specular` likewise with
  (n·h)^(1/roughness).
- Anti-aliasing weighs samples in its own way: the picture is made larger, and averaged here.
- Pictures are OpenEXR of half floats: 11 bits, at most 65504.
- `checker` alternates along y too: it is moved so that the plane lies in the middle of a layer.
"""

import lookmatch_worker as worker
from lookmatch_worker import Refused, Timer, colour, number

import math
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR

FADE = 0.001  # metres: `fade_distance`
LARGEST = 8192  # pixels on a side of the picture that is averaged

COLOR = colour("color", "diffuse-reflectance", [0.5, 0.5, 0.5], summary="Pigment; the finish has diffuse 1.")
MODELS = [
    {
        "name": "phong",
        "title": "finish with phong",
        "summary": "Power of the cosine between mirror direction and light, not normalised, above a Lambert term.",
        "has_fresnel": False,
        "parameters": [
            COLOR,
            number("phong", "specular-reflectance", 0.5, (0.0, 10.0), search=(0.0, 3.0, 0.05), survey=(0.1, 2.0, 0.2)),
            number("phong_size", "exponent", 40.0, (1.0, 1000.0), search=(2.0, 250.0, 4.0), survey=(5.0, 250.0, 35.0)),
        ],
        "surveyed": ["phong", "phong_size"],
        "searched": ["phong", "phong_size"],
    },
    {
        "name": "specular",
        "title": "finish with specular",
        "summary": "Power (1 / roughness) of the cosine of the half vector, not normalised, above a Lambert term.",
        "has_fresnel": False,
        "parameters": [
            COLOR,
            number("specular", "specular-reflectance", 0.5, (0.0, 10.0), search=(0.0, 3.0, 0.05), survey=(0.1, 2.0, 0.2)),
            number(
                "roughness",
                "lobe-shape",
                0.02,
                (0.001, 1.0),
                summary="One over the exponent of the cosine; related to no microfacet roughness by more than its name.",
                search=(0.001, 0.4, 0.004),
                survey=(0.005, 0.3, 0.03),
            ),
        ],
        "surveyed": ["specular", "roughness"],
        "searched": ["specular", "roughness"],
    },
]


def vector(numbers):
    return "<" + ", ".join(repr(float(x)) for x in numbers) + ">"


def camera(described):
    # Square pictures: the horizontal angle is the vertical one. `look_at` uses what stands before it, and comes last.
    return (
        f"camera {{ location {vector(described['eye'])} sky {vector(described['up'])} up y right -x "
        f"angle {described['vertical_fov']!r} look_at {vector(described['target'])} }}\n"
    )


def light(described):
    strength = np.array(described["intensity"]) / (2 * math.pi * FADE**2)
    return f"light_source {{ {vector(described['position'])} rgb {vector(strength)} fade_distance {FADE} fade_power 2 }}\n"


def checkerboard(plane):
    height, half, check = plane["height"], plane["half_extent"], plane["check_size"]
    corners = [(x * half, height, z * half) for x, z in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    checks = f"checker rgb {vector(plane['light'])}, rgb {vector(plane['dark'])} scale {check!r}"
    return (
        f"polygon {{ 5, {', '.join(map(vector, corners))} pigment {{ {checks} translate {height - check / 2!r}*y }} "
        "finish { ambient 0 diffuse 1 } }\n"
    )


class PovRay:
    def __init__(self):
        self.program = shutil.which("povray")
        self.scenes = {}
        self.texture = None

    def hello(self):
        if self.program is None:
            raise Refused("no povray in PATH: install it")
        said = subprocess.run([self.program, "--version"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        found = re.search(r"POV-Ray (\d[\w.]*)", said.stdout)
        return {
            "name": "povray",
            "version": found[1] if found else "unknown",
            "licence": "AGPL-3.0-or-later",
            "models": MODELS,
            "capabilities": {
                "deterministic": "exact",
                "seeds": False,
                "noise": False,
                "samples": "the picture is traced k times as large and averaged, k = the square root rounded, at most "
                f"{LARGEST} pixels a side; more only smooth edges",
                "lights": ["point"],
                "threads": "all",
                "cancel": False,
                "interreflection": False,
            },
            "check": {
                "lambert": {"model": "phong", "values": {"phong": 0.0, "phong_size": 40.0}, "parameter": "color"},
                "mirror": None,
            },
            "approximations": [
                "Highlights come from point lights only, and there is no other kind of light here.",
                "Only direct light: sphere and plane do not light each other.",
                "Pixels are half floats before they are averaged: 11 bits, at most 65504.",
            ],
        }

    def scene(self, name, scene, environment):
        if environment is not None:
            raise Refused("environment: POV-Ray's highlights do not see it; only point_lights are done")
        parts = [camera(scene["camera"]), *map(light, scene["point_lights"])]
        if scene["plane"] is not None:
            parts.append(checkerboard(scene["plane"]))
        self.scenes[name] = scene["size"], scene["spheres"], "".join(parts)

    def material(self, model, values):
        known = next((m for m in MODELS if m["name"] == model), None)
        if known is None:
            raise Refused(f"unknown model '{model}'; known are {', '.join(m['name'] for m in MODELS)}")
        finish = " ".join(f"{p['name']} {float(values[p['name']])!r}" for p in known["parameters"][1:])
        self.texture = f"pigment {{ rgb {vector(values['color'])} }} finish {{ ambient 0 diffuse 1 {finish} }}"

    def render(self, name, samples, seed):
        if name not in self.scenes:
            raise Refused(f"unknown scene '{name}'; known are {', '.join(self.scenes) or 'none'}")
        if self.texture is None:
            raise Refused("no material is set")
        size, spheres, rest = self.scenes[name]
        side = max(1, min(round(math.sqrt(samples)), LARGEST // size))
        balls = [f"sphere {{ {vector(s['centre'])}, {s['radius']!r} {self.texture} }}\n" for s in spheres]
        head = "#version 3.7;\nglobal_settings { assumed_gamma 1 }\n"
        with Timer() as timer:
            large = self.trace(head + rest + "".join(balls), side * size)
            pixels = large.reshape(size, side, size, side, 3).mean(axis=(1, 3), dtype=np.float64)
        return pixels, {"samples": side * side, **timer.info}

    def trace(self, description, size):
        """A picture of the scene, row 0 on top."""
        # -D no window, +FE OpenEXR, -A no anti-aliasing, -GA no messages. It may read and write in its current folder only.
        options = ["+Iscene.pov", "+Opicture.exr", "+FE", f"+W{size}", f"+H{size}", "-D", "-A", "-GA"]
        with tempfile.TemporaryDirectory(prefix="lookmatch-povray-") as folder:
            Path(folder, "scene.pov").write_text(description)
            done = subprocess.run([self.program, *options], cwd=folder, capture_output=True, text=True)
            if done.returncode != 0:
                raise RuntimeError(f"povray ended with status {done.returncode}: {' '.join(done.stderr.split()[-40:])}")
            with OpenEXR.File(str(Path(folder, "picture.exr"))) as picture:
                channels = picture.channels()
                colours = channels["RGB"] if "RGB" in channels else channels["RGBA"]
                return colours.pixels[..., :3].astype(np.float32)


worker.serve(PovRay())
