"""Renders the pictures of a look match with Mitsuba 3: python render.py [SAMPLES]."""

import pathlib
import sys

import mitsuba as mi

# Needs neither LLVM nor a GPU; "llvm_ad_rgb" is faster where LLVM is installed.
mi.set_variant("scalar_rgb")

folder = pathlib.Path(__file__).resolve().parent
samples = sys.argv[1] if len(sys.argv) > 1 else "256"
for material in "full", "diffuse":
    for light in "point", "environment":
        scene = mi.load_file(str(folder / "scene.xml"), light=light, material=material, spp=samples)
        picture = mi.Bitmap(mi.render(scene)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
        picture.write(str(folder / f"{material}_{light}.exr"))
        print(f"{material}_{light}.exr")
