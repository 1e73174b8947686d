"""A renderer that draws no scene: its pictures brighten to the right by the material's colour, with a little noise. For tests of
what the program makes of materials of other renderers."""

import json
import random
import struct
import sys

UNIT = {"min": 0.0, "max": 1.0}
ALPHA = {"name": "alpha", "role": "roughness", "kind": "number", "default": 0.25, "valid": {**UNIT, "open": True}}
ALPHA["search"] = {"min": 0.25, "max": 0.75, "step": 0.25}
COLOUR = {"name": "colour", "role": "base-colour", "kind": "colour", "default": [0.5, 0.5, 0.5], "valid": UNIT}
MODEL = {"name": "plastic", "parameters": [COLOUR, ALPHA], "surveyed": ["alpha"], "searched": ["alpha"]}
METAL = {"name": "metal", "parameters": [ALPHA], "surveyed": ["alpha"], "searched": ["alpha"]}
HELLO = {
    "protocol": 1,
    "name": "fake",
    "version": "1.0",
    "licence": "MIT",
    "models": [MODEL, METAL],
    "capabilities": {
        "deterministic": "exact",
        "seeds": True,
        "noise": True,
        "samples": "nothing",
        "lights": ["point", "environment"],
        "threads": "all",
        "cancel": False,
        "interreflection": False,
    },
    "check": {"lambert": {"model": "plastic", "values": {}, "parameter": "colour"}, "mirror": None},
    "approximations": [],
}


def picture(size, values, seed):
    noise = random.Random(seed)
    colour = values.get("colour", [0.0] * 3)
    pixel = lambda x: [0.1 + (c + values["alpha"]) * x / size + noise.gauss(0.0, 0.01) for c in colour]
    numbers = [v for _ in range(size) for x in range(size) for v in pixel(x)]
    return struct.pack(f"<{len(numbers)}f", *numbers)


size, values = 0, {}
for line in sys.stdin.buffer:
    request, data, answer = json.loads(line), b"", {}
    sys.stdin.buffer.read(request.get("bytes", 0))
    if request["request"] == "hello":
        answer = HELLO
    elif request["request"] == "scene":
        size = request["size"]
    elif request["request"] == "material":
        values = request["values"]
    elif request["request"] == "render":
        data = picture(size, values, request["seed"])
        answer = {"width": size, "height": size, "samples": request["samples"] + 1, "cpu_s": 0.5, "wall_s": 0.25, "bytes": len(data)}
    sys.stdout.buffer.write(json.dumps({"id": request["id"], **answer}).encode() + b"\n" + data)
    sys.stdout.buffer.flush()
    if request["request"] == "shutdown":
        break
