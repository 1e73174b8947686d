"""Reference values of gltf, gltf-spec-gloss and usd-preview-surface from the shaders of the formats' own viewers.

    python3 make_shaders.py BRDF_GLSL PREVIEW_SURFACE_GLSLFX > shaders.json

BRDF_GLSL is source/Renderer/shaders/brdf.glsl of KhronosGroup/glTF-Sample-Viewer (commit d0b428c), PREVIEW_SURFACE_GLSLFX is
pxr/usdImaging/plugin/usdShaders/shaders/previewSurface.glslfx of PixarAnimationStudios/OpenUSD (commit 00dd17a). Both are
compiled as C++ (g++ 12) with every `float` a double. The values in shaders.json come from copies of the two files reduced by
hand to the functions that are named here. What runs of them:

* glTF: Fresnel, D and V of GGX, isotropic and anisotropic, D and Λ of the sheen, the Lambert term. How they are put together
  is written below from the texts of the extensions: a second writing, not an independent one. The viewer cuts its
  visibilities off at 1; for the sheen that is left out, and directions where it happens to the anisotropic lobe are not used.
* UsdPreviewSurface: Storm's whole evaluateLight; for the variant `exact` with EPSILON 0 and PI exact.
"""

import json
import math
import random
import re
import subprocess
import sys
import tempfile
from pathlib import Path

PRELUDE = r"""
#include <cmath>
#include <cstdio>
#include <algorithm>
#include <vector>
#include <iostream>
using std::pow; using std::sqrt; using std::exp; using std::abs; using std::max; using std::min;
#define float double
struct vec3 { double x, y, z; explicit vec3(double s = 0) : x(s), y(s), z(s) {} vec3(double a, double b, double c) : x(a), y(b), z(c) {} };
#define OP(o) \
  vec3 operator o(vec3 a, vec3 b) { return vec3(a.x o b.x, a.y o b.y, a.z o b.z); } \
  vec3 operator o(vec3 a, double b) { return a o vec3(b); } \
  vec3 operator o(double a, vec3 b) { return vec3(a) o b; }
OP(+) OP(-) OP(*) OP(/)
vec3& operator*=(vec3& a, vec3 b) { return a = a * b; }
vec3& operator*=(vec3& a, double b) { return a = a * b; }
double dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(vec3 a) { return sqrt(dot(a, a)); }
double clamp(double v, double a, double b) { return min(max(v, a), b); }
double mix(double a, double b, double t) { return a * (1 - t) + b * t; }
vec3 mix(vec3 a, vec3 b, double t) { return a * (1 - t) + b * t; }
double max3(vec3 v) { return max(v.x, max(v.y, v.z)); }
"""

MAIN = r"""
struct Pair { vec3 l, v, h; double NL, NV, NH, VH; };

double sheen(double roughness, double NL, double NV, double NH) {
    double a = roughness * roughness;
    return D_Charlie(roughness, NH) / ((1 + lambdaSheen(NV, a) + lambdaSheen(NL, a)) * 4 * NL * NV);
}

// Directional albedo of the sheen, by brute force over the light's hemisphere.
double E(double roughness, double NV) {
    const int rows = 2000, columns = 400;
    double sum = 0, s = sqrt(1 - NV * NV);
    for (int i = 0; i < rows; i++) {
        double theta = M_PI / 2 * (i + 0.5) / rows;
        for (int j = 0; j < columns; j++) {
            double phi = M_PI * (j + 0.5) / columns;
            vec3 h(sin(theta) * cos(phi) + s, sin(theta) * sin(phi), cos(theta) + NV);
            double f = sheen(roughness, cos(theta), NV, h.z / length(h));
            sum += f * cos(theta) * sin(theta) * (M_PI / 2 / rows) * (2 * M_PI / columns);
        }
    }
    return min(sum, 1.0);
}

struct Reader {
    double number() { double v; std::cin >> v; return v; }
    vec3 colour() { double r = number(), g = number(), b = number(); return vec3(r, g, b); }
};

vec3 gltf(Reader& in, const Pair& p) {
    vec3 base = in.colour(); double metallic = in.number(), roughness = in.number(), ior = in.number();
    double specular = in.number(); vec3 specularColor = in.colour();
    double clearcoat = in.number(), clearcoatRoughness = in.number();
    vec3 sheenColor = in.colour(); double sheenRoughness = in.number(), anisotropy = in.number();
    double alpha = roughness * roughness;
    vec3 n(0, 0, 1), t(1, 0, 0), b(0, 1, 0);
    vec3 lobe = anisotropy > 0 ? BRDF_specularGGXAnisotropy(alpha, anisotropy, n, p.v, p.l, p.h, t, b)
                               : BRDF_specularGGX(alpha, p.NL, p.NV, p.NH);
    double r = (ior - 1) / (ior + 1);
    vec3 scaled = r * r * specularColor;
    vec3 f0 = vec3(min(scaled.x, 1.0), min(scaled.y, 1.0), min(scaled.z, 1.0)) * specular;
    vec3 fr = F_Schlick(f0, vec3(specular), p.VH);
    vec3 dielectric = fr * lobe + (1 - max3(fr)) * BRDF_lambertian(base);
    vec3 metal = F_Schlick(base, vec3(1.0), p.VH) * lobe;
    vec3 material = mix(dielectric, metal, metallic);
    if (max3(sheenColor) > 0) {
        double scale = min(1 - max3(sheenColor) * E(sheenRoughness, p.NV), 1 - max3(sheenColor) * E(sheenRoughness, p.NL));
        material = sheenColor * sheen(sheenRoughness, p.NL, p.NV, p.NH) + material * scale;
    }
    vec3 coat = BRDF_specularGGX(clearcoatRoughness * clearcoatRoughness, p.NL, p.NV, p.NH);
    return clearcoat > 0 ? mix(material, coat, clearcoat * F_Schlick(0.04, 1.0, p.NV)) : material;
}

vec3 specularGlossiness(Reader& in, const Pair& p) {
    vec3 diffuse = in.colour(), specular = in.colour(); double glossiness = in.number();
    vec3 F = F_Schlick(specular, vec3(1.0), p.VH);
    double alpha = (1 - glossiness) * (1 - glossiness);
    return (1.0 - F) * BRDF_lambertian(diffuse * (1 - max3(specular))) + F * BRDF_specularGGX(alpha, p.NL, p.NV, p.NH);
}

template <class Light> vec3 preview(Reader& in, const Pair& p, Light light) {
    vec3 diffuse = in.colour(); bool workflow = in.number() == 1; vec3 specular = in.colour();
    double metallic = in.number(), roughness = in.number(), clearcoat = in.number(), coat = in.number(), ior = in.number();
    auto c = light(diffuse, workflow, ior, metallic, 1, specular, roughness, clearcoat, vec3(1.0), coat, 1,
                   p.NL, p.NV, p.NH, p.VH, vec3(1.0), vec3(1.0));
    return (c.diffuse + c.specular) / p.NL;
}

int main() {
    std::string model; Reader in;
    while (std::cin >> model) {
        Pair p; p.l = in.colour(); p.v = in.colour();
        vec3 h = p.l + p.v; p.h = h / length(h);
        p.NL = p.l.z; p.NV = p.v.z; p.NH = p.h.z; p.VH = dot(p.v, p.h);
        vec3 f = model == "gltf" ? gltf(in, p) : model == "gltf-spec-gloss" ? specularGlossiness(in, p)
               : model == "storm" ? preview(in, p, storm::evaluateLight) : preview(in, p, exact::evaluateLight);
        printf("%.17g %.17g %.17g\n", f.x, f.y, f.z);
    }
}
"""


def program(brdf_glsl, preview_glslfx):
    storm = re.search(r"-- glsl Preview\.LightStructures(.*)-- glsl Preview\.LightIntegration", preview_glslfx, re.S)[1]
    storm = storm.replace("-- glsl Preview.Lighting", "")
    exact = storm.replace("#define PI 3.1415", f"#undef PI\n#define PI {math.pi!r}")
    exact = exact.replace("#define EPSILON 0.001", "#undef EPSILON\n#define EPSILON 0.0")
    khronos = "#define MATERIAL_ANISOTROPY\n" + brdf_glsl
    return f"{PRELUDE}\n{khronos}\nnamespace storm {{ {storm} }}\nnamespace exact {{ {exact} }}\n{MAIN}"


def run(source, lines):
    with tempfile.TemporaryDirectory() as folder:
        cpp, binary = Path(folder, "shaders.cpp"), Path(folder, "shaders")
        cpp.write_text(source)
        subprocess.run(["g++", "-O2", "-std=c++17", "-o", binary, cpp], check=True)
        output = subprocess.run([binary], input="\n".join(lines), text=True, capture_output=True, check=True).stdout
    return [[float(v) for v in line.split()] for line in output.splitlines()]


def directions(kind):
    """Two unit vectors above the surface: anywhere, or near each other's mirror direction."""
    def anywhere():
        z, phi = random.uniform(0.05, 1), random.uniform(0, 2 * math.pi)
        s = math.sqrt(1 - z * z)
        return [s * math.cos(phi), s * math.sin(phi), z]
    wo = anywhere()
    wi = anywhere()
    if kind == "lobe":
        near = [-wo[0], -wo[1], wo[2]]
        wi = [n + 0.15 * random.gauss(0, 1) for n in near]
        wi[2] = max(wi[2], 0.05)
    length = math.sqrt(sum(c * c for c in wi))
    return [c / length for c in wi], wo


def number(low=0.0, high=1.0):
    return round(random.uniform(low, high), 3)


def colour(high=1.0):
    return [number(0, high) for _ in range(3)]


def gltf(case):
    params = dict(base_color=colour(), metallic=0.0, roughness=number(0.15), ior=1.5, specular=1.0, specular_color=[1.0] * 3,
                  clearcoat=0.0, clearcoat_roughness=0.0, sheen_color=[0.0] * 3, sheen_roughness=0.0, anisotropy_strength=0.0)
    if case in ("specular", "all"):
        params.update(metallic=number(), ior=number(1.0, 3.0), specular=number(), specular_color=colour(3.0))
    if case in ("anisotropy", "all"):
        params.update(metallic=number(), anisotropy_strength=number(0.1))
    if case in ("clearcoat", "all"):
        params.update(clearcoat=number(0.1), clearcoat_roughness=number(0.15))
    if case in ("sheen", "sheen lobe", "all"):
        params.update(sheen_color=colour(), sheen_roughness=number(0.15))
    if case == "sheen lobe":
        params.update(base_color=[0.0] * 3, specular=0.0)
    return params


def preview_surface(case):
    return dict(diffuse_color=colour(), use_specular_workflow=str(random.randrange(2)), specular_color=colour(),
                metallic=number(), roughness=number(0.2), clearcoat=number(), clearcoat_roughness=number(0.2),
                ior=number(1.05, 2.5), variant=case)


def specular_glossiness(_):
    return dict(diffuse=colour(), specular=colour(), glossiness=number(0, 0.85))


CASES = [("gltf", gltf, c) for c in ("specular", "anisotropy", "clearcoat", "sheen lobe", "sheen", "all")]
CASES += [("gltf-spec-gloss", specular_glossiness, "")]
CASES += [("usd-preview-surface", preview_surface, c) for c in ("exact", "storm")]


def is_cut_off(params, wi, wo):
    """True where the viewer cuts the visibility of its anisotropic lobe off at 1."""
    if params.get("anisotropy_strength", 0.0) == 0.0:
        return False
    alpha = params["roughness"] ** 2
    along = alpha + (1 - alpha) * params["anisotropy_strength"] ** 2
    stretched = lambda w: math.hypot(along * w[0], alpha * w[1], w[2])
    return 0.5 / (wi[2] * stretched(wo) + wo[2] * stretched(wi)) >= 1.0


def flat(value):
    return " ".join(map(repr, value)) if isinstance(value, list) else str(value)


def main():
    random.seed(20261122)
    vectors, lines = [], []
    for model, make, case in CASES:
        count = 0
        while count < 12:
            kind = "lobe" if count % 2 == 0 else "uniform"
            params, (wi, wo) = make(case), directions(kind)
            if is_cut_off(params, wi, wo):
                continue
            count += 1
            # The scale of what lies beneath a sheen comes from a table.
            rtol = 2e-3 if case in ("sheen", "all") else 1e-9
            vectors.append(dict(model=model, case=case, kind=kind, params=params, wi=wi, wo=wo, rtol=rtol))
            values = [flat(v) for k, v in params.items() if k != "variant"]
            shader = case if model == "usd-preview-surface" else model
            lines.append(" ".join([shader, flat(wi), flat(wo), *values]))
    for vector, f in zip(vectors, run(program(*(Path(p).read_text() for p in sys.argv[1:3])), lines), strict=True):
        vector["f"] = f
    rows = ",\n".join(json.dumps(v) for v in vectors)
    print('{"schema": "brdf vectors of catalogue materials", "brdf": [\n' + rows + "\n]}")


main()
