"""Renders a sphere on a checkerboard with Mitsuba 3, for `lookmatch bench --peer mitsuba`.

Argument: the variant of Mitsuba. Each line of standard input is a request in JSON, each line of standard output the
answer to one; pictures are written as EXR files. The first request describes the scene, the others ask for pictures.
"""

import json
import os
import sys
import time

# Libraries print to standard output; what they say must not end up between the answers.
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)

import drjit as dr
import mitsuba as mi

mi.set_variant(sys.argv[1])
mi.set_log_level(mi.LogLevel.Error)

Transform = mi.ScalarTransform4f


def rgb(value):
    return {"type": "rgb", "value": value}


def camera(description, size, sampler):
    return {
        "type": "perspective",
        "fov": description["vertical_fov"],
        "fov_axis": "y",
        "to_world": Transform().look_at(
            origin=description["eye"], target=description["target"], up=description["up"]
        ),
        "film": {
            "type": "hdrfilm",
            "width": size,
            "height": size,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": sampler},
    }


def checkerboard(plane):
    """A corner of a check lies at x = z = 0; the check at 0 < x, z is light."""
    half = plane["half_extent"]
    # A unit of Mitsuba's pattern is two checks wide.
    periods = half / plane["check_size"]
    pattern = {
        "type": "checkerboard",
        "color0": rgb(plane["dark"]),
        "color1": rgb(plane["light"]),
        "to_uv": Transform().translate([-periods / 2, -periods / 2, 0]).scale([periods, periods, 1]),
    }
    upwards = Transform().translate([0, plane["height"], 0]).rotate([1, 0, 0], -90).scale([half, half, 1])
    return {
        "type": "rectangle",
        "to_world": upwards,
        "bsdf": {"type": "diffuse", "reflectance": pattern},
    }


def light(request):
    if request["light"] == "environment":
        return {"type": "envmap", "filename": request["environment_map"]}
    point = request["scene"]["point_light"][0]
    return {"type": "point", "position": point["position"], "intensity": rgb(point["intensity"])}


def lobe(material, scale):
    """GGX with separable Smith masking and exact Fresnel reflectance: a dielectric is a conductor with k = 0."""
    index = material.get("eta", [material.get("ior", 1)] * 3)
    return {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha": material["roughness_u"],
        "eta": rgb(index),
        "k": rgb(material.get("k", [0] * 3)),
        "specular_reflectance": scale,
    }


def surface(material):
    """The same function as lookmatch's. Its diffuse term is not coupled to the interface, as roughplastic's is, so a plastic
    is a sum: a blend of both terms, each divided by its share. The share gives about the least noise."""
    if "diffuse" not in material:
        return lobe(material, 1.0)
    share = 0.2
    return {
        "type": "blendbsdf",
        "weight": share,
        "first": {"type": "diffuse", "reflectance": rgb([d / (1 - share) for d in material["diffuse"]])},
        "second": lobe(material, 1 / share),
    }


def load(request):
    scene = request["scene"]
    sphere = scene["sphere"][0]
    return mi.load_dict(
        {
            "type": "scene",
            # All bounces: the default, with Russian roulette from the fifth on.
            "integrator": {"type": "path"},
            "sensor": camera(scene["camera"], request["size"], request["sampler"]),
            "sphere": {
                "type": "sphere",
                "center": sphere["centre"],
                "radius": sphere["radius"],
                "bsdf": surface(request["material"]),
            },
            "plane": checkerboard(scene["plane"]),
            "light": light(request),
        }
    )


def render(scene, request):
    cpu, wall = time.process_time(), time.perf_counter()
    image = mi.render(scene, spp=request["samples"], seed=request["seed"])
    dr.eval(image)
    dr.sync_thread()
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    mi.Bitmap(image).write(request["output"])
    # Samplers round the number of samples to one that they can stratify.
    return {"cpu_s": cpu, "wall_s": wall, "samples": scene.sensors()[0].sampler().sample_count()}


def main():
    scene = None
    for line in sys.stdin:
        request = json.loads(line)
        if scene is None:
            scene = load(request)
            answer = {"version": mi.__version__}
        else:
            answer = render(scene, request)
        print(json.dumps(answer), file=answers, flush=True)


main()
