"""Validates a MaterialX document with the official library, evaluates its node at points, and generates shaders from it.

usage: export_materialx.py DOCUMENT, with points as a JSON list of objects on standard input; prints a JSON list of objects.
Only nodes of the standard library are known here, with the meaning that MaterialX's specification gives them.
"""
import json
import math
import sys

import MaterialX as mx
import MaterialX.PyMaterialXGenGlsl as gen_glsl
import MaterialX.PyMaterialXGenOsl as gen_osl
import MaterialX.PyMaterialXGenShader as gen_shader


def load(path):
    search = mx.getDefaultDataSearchPath()
    library, document = mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), search, library)
    own = mx.createDocument()
    mx.readFromXmlFile(own, path)
    graphs = [graph.getName() for graph in own.getNodeGraphs()]
    document.importLibrary(library)
    mx.readFromXmlFile(document, path)
    valid, message = document.validate()
    if not valid:
        sys.exit(f"not valid: {message}")
    return document, document.getNodeGraph(graphs[0]), search


def each(function, *values):
    """A function for each channel; single numbers serve all of them."""
    size = max((len(v) for v in values if isinstance(v, list)), default=0)
    if size == 0:
        return function(*values)
    return [function(*(v[c] if isinstance(v, list) else v for v in values)) for c in range(size)]


def transform(vector, matrix):
    """Vectors are rows."""
    return [sum(vector[c] * matrix[4 * c + r] for c in range(4)) for r in range(4)]


NODES = {
    "add": lambda i: each(lambda a, b: a + b, i["in1"], i["in2"]),
    "subtract": lambda i: each(lambda a, b: a - b, i["in1"], i["in2"]),
    "multiply": lambda i: each(lambda a, b: a * b, i["in1"], i["in2"]),
    "divide": lambda i: each(lambda a, b: a / b, i["in1"], i["in2"]),
    "max": lambda i: each(max, i["in1"], i["in2"]),
    "clamp": lambda i: each(lambda v, a, b: min(max(v, a), b), i["in"], i["low"], i["high"]),
    "remap": lambda i: each(lambda v, a, b, c, d: c + (v - a) * (d - c) / (b - a),
                            i["in"], i["inlow"], i["inhigh"], i["outlow"], i["outhigh"]),
    "convert": lambda i: [i["in"]] * 4,
    "dotproduct": lambda i: sum(a * b for a, b in zip(i["in1"], i["in2"])),
    "transformmatrix": lambda i: transform(i["in"], i["mat"]),
    "combine3": lambda i: [i["in1"], i["in2"], i["in3"]],
    "combine4": lambda i: [i["in1"], i["in2"], i["in3"], i["in4"]],
    "ifgreater": lambda i: i["in1"] if i["value1"] > i["value2"] else i["in2"],
    "exp": lambda i: math.exp(i["in"]),
    "ln": lambda i: math.log(i["in"]),
    "constant": lambda i: i["value"],
}


def number(text):
    values = [float(v) for v in text.split(",")]
    return values[0] if len(values) == 1 else values


def evaluate(graph, point):
    known = {}

    def read(port):
        if port.getInterfaceName():
            return point[port.getInterfaceName()]
        name = port.getNodeName()
        if not name:
            return number(port.getValueString())
        node = graph.getNode(name)
        if node.getCategory() == "separate3":
            return read(node.getInput("in"))[["outr", "outg", "outb"].index(port.getOutputString())]
        if name not in known:
            definition = node.getNodeDef()
            inputs = {i.getName(): number(i.getValueString()) for i in definition.getActiveInputs()
                      if i.getValueString() and i.getType() != "string"}
            inputs.update({i.getName(): read(i) for i in node.getInputs()})
            known[name] = NODES[node.getCategory()](inputs)
        return known[name]

    return {output.getName(): read(output) for output in graph.getOutputs()}


def generate(document, search):
    """Shaders in two languages, of the material where there is one, else of an instance of the node."""
    materials = document.getMaterialNodes()
    if materials:
        element = document.getNode("surface")
    else:
        definition = next(d for d in document.getNodeDefs() if d.getName() == graph.getNodeDefString())
        instance = document.addNodeInstance(definition, "instance")
        element = document.addOutput("checked", definition.getOutputs()[0].getType())
        element.setNodeName(instance.getName())
        element.setOutputString(definition.getOutputs()[0].getName())
    for generator in (gen_glsl.EsslShaderGenerator.create(), gen_osl.OslShaderGenerator.create()):
        context = gen_shader.GenContext(generator)
        context.registerSourceCodeSearchPath(search)
        shader = generator.generate("checked", element, context)
        if not shader or len(shader.getSourceCode(gen_shader.PIXEL_STAGE)) < 500:
            sys.exit(f"no shader of {generator.getTarget()}")


sys.setrecursionlimit(100_000)
document, graph, search = load(sys.argv[1])
results = [evaluate(graph, point) for point in json.load(sys.stdin)]
generate(document, search)
print(json.dumps(results))
