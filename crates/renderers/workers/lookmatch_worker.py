# SPDX-License-Identifier: MIT OR Apache-2.0
"""The worker's side of the renderer protocol (docs/renderer-protocol.md), for renderers with a Python interface.

A worker is a file that imports this module before anything else and ends with `serve(Renderer())`. `Renderer` has

    hello() -> dict                                  fields of the answer, without `protocol`
    scene(name, scene, environment)                  environment: float32 array (height, width, 3), or None
    material(model, values)                          values: dict, complete
    render(name, samples, seed) -> (pixels, info)    pixels: (size, size, 3), row 0 on top; info: more fields of the answer
    close()                                          optional; may be called in the middle of a render

Errors that a user can understand are raised as `Refused`; any other exception is reported with its last line and logged whole.
"""

import os
import select
import signal
import sys

# Before any import that may print: answers get a descriptor of their own, and whatever is printed goes to the log.
_answers = os.fdopen(os.dup(1), "wb", buffering=0)
os.dup2(2, 1)


def _watch(stdin):
    """Ends the worker's process group when lookmatch is gone: in the middle of a render nothing else would notice."""
    parent = os.getppid()
    poll = select.poll()
    # Nothing is asked for: a closed other end is always reported.
    poll.register(stdin, 0)
    while not poll.poll(500):
        if os.getppid() != parent:
            os._exit(0)
    for _ in range(10):
        if os.getppid() != parent:
            os._exit(0)
        select.select([], [], [], 0.1)
    os.kill(parent, signal.SIGKILL)
    if os.getpgid(0) == parent:
        os.killpg(parent, signal.SIGKILL)
    os._exit(0)


if hasattr(os, "fork") and not sys.stdin.isatty() and os.fork() == 0:
    _answers.close()
    _watch(0)

import json
import queue
import threading
import time
import traceback

import numpy as np

PROTOCOL = 1


class Refused(Exception):
    """A request that the renderer cannot do; the text says what would be accepted."""


def parameter(name, role, kind, default, valid=None, search=None, survey=None, **more):
    """A parameter of a model. `valid` is (min, max) or (min, max, "open"), `search` and `survey` are (min, max, step)."""
    described = {"name": name, "role": role, "kind": kind, "default": default, **more}
    if valid is not None:
        described["valid"] = {"min": valid[0], "max": valid[1], "open": len(valid) == 3}
    for key, levels in (("search", search), ("survey", survey)):
        if levels is not None:
            described[key] = dict(zip(("min", "max", "step"), levels))
    return described


def number(name, role, default, valid, **more):
    return parameter(name, role, "number", default, valid, **more)


def colour(name, role, default, valid=(0.0, 1.0), **more):
    return parameter(name, role, "colour", default, valid, **more)


def choice(name, options, role="variant", **more):
    return parameter(name, role, "choice", options[0], options=options, **more)


class Timer:
    """CPU seconds of all threads and seconds by the clock; `children` adds those of processes that were waited for."""

    def __enter__(self):
        self.begin = self._now()
        return self

    def __exit__(self, *_):
        cpu, wall = (end - begin for end, begin in zip(self._now(), self.begin))
        self.info = {"cpu_s": cpu, "wall_s": wall}

    @staticmethod
    def _now():
        times = os.times()
        return times.user + times.system + times.children_user + times.children_system, time.perf_counter()


cancelled = threading.Event()
_sending = threading.Lock()


def _send(message, data=b""):
    if data:
        message["bytes"] = len(data)
    with _sending:
        packet = memoryview(json.dumps(message).encode() + b"\n" + data)
        while packet:
            packet = packet[_answers.write(packet) :]


_current = None


def progress(done):
    """Tells how much of the current request is done, 0 to 1: a worker that says nothing for long is taken for dead."""
    _send({"id": _current, "progress": done})


def _close(renderer):
    if hasattr(renderer, "close"):
        renderer.close()


def _read(requests, renderer):
    """Reads requests for ever; the end of the input ends the process, whatever it is doing."""
    stdin = sys.stdin.buffer
    for line in stdin:
        request = json.loads(line)
        data = stdin.read(request.get("bytes", 0))
        if request["request"] == "cancel":
            cancelled.set()
        requests.put((request, data))
    _close(renderer)
    os._exit(0)


def _answer(renderer, request, data):
    name = request["request"]
    if name == "hello":
        if request.get("protocol") != PROTOCOL:
            raise Refused(f"this worker speaks version {PROTOCOL} of the protocol, not {request.get('protocol')}")
        return {"protocol": PROTOCOL, **renderer.hello()}, b""
    if name == "scene":
        environment = request.get("environment")
        if environment is not None:
            shape = environment["height"], environment["width"], 3
            environment = np.frombuffer(data, "<f4").reshape(shape)
        renderer.scene(request["scene"], request, environment)
        return {}, b""
    if name == "material":
        renderer.material(request["model"], request["values"])
        return {}, b""
    if name == "render":
        cancelled.clear()
        pixels, info = renderer.render(request["scene"], request["samples"], request["seed"])
        pixels = np.ascontiguousarray(pixels, "<f4")
        height, width, _ = pixels.shape
        return {"width": width, "height": height, **info}, pixels.tobytes()
    if name in ("cancel", "shutdown"):
        return {}, b""
    raise Refused(f"unknown request '{name}'; known are hello, scene, material, render, cancel and shutdown")


def serve(renderer):
    """Answers requests until the input ends or a shutdown is asked for."""
    global _current
    requests = queue.Queue()
    threading.Thread(target=_read, args=(requests, renderer), daemon=True).start()
    while True:
        request, data = requests.get()
        identity = _current = request.get("id")
        try:
            answer, data = _answer(renderer, request, data)
            _send({"id": identity, **answer}, data)
        except Refused as refusal:
            _send({"id": identity, "error": str(refusal)})
        except Exception as failure:
            traceback.print_exc()
            _send({"id": identity, "error": f"{type(failure).__name__}: {failure}"})
        if request["request"] == "shutdown":
            _close(renderer)
            # Some renderers abort when the interpreter takes them down.
            os._exit(0)
