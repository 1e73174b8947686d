// SPDX-License-Identifier: MIT OR Apache-2.0
// /// script
// requires-node = ">=20.6"
// dependencies = ["three@0.187.0", "puppeteer-core@25.16.0"]
// [tool.lookmatch]
// title = "three.js"
// licence = "MIT"
// about = "The rasteriser of the web: MeshPhysicalMaterial, MeshStandardMaterial and MeshLambertMaterial, drawn by headless Chromium."
// debian = ["chromium"]
// ///

// A worker for three.js, and the example of one in another language: all of docs/renderer-protocol.md is in this file.
//
// Node speaks the protocol; the pictures are drawn by three.js in a page of headless Chromium, in software (SwiftShader), so that they
// are the same everywhere. The page has no network: its two modules come from node_modules by way of the debugging pipe.
//
// Conventions of three.js
// - `roughness` is perceptual: α = roughness².
// - With decay 2 a point light's intensity is in candela, which is W/sr here, and a Lambert surface returns albedo / π of it.
// - Rows of pictures that are read back begin at the bottom.
//
// Traps
// - `scene.background` and equirectangular maps turn the environment by 90°, flip its rows and resample it. Here one sky of our own,
//   which looks up the map by direction, is both the background and what the prefiltered environment is made of.
// - Prefiltered environments are half floats: brighter maps are scaled down, and the scale is given back as environmentIntensity.
// - By default shadows are cast by back faces, and light leaks in where a sphere touches the plane: cast them by front faces, and move
//   the receiver out along its normal by a texel, so that they do not shade themselves.
// - Roughness is widened by the change of the normal from pixel to pixel, so that a material depends on the size of the picture (by 0.01
//   at 300 pixels): supersampling does what this is for, so it is taken out of the shader.
// - The default shadow filter takes its pattern from the pixel's position: use the unfiltered one, which supersampling smooths.

import { spawn } from "node:child_process";
import { accessSync, constants, mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { delimiter, join } from "node:path";
import { performance } from "node:perf_hooks";
import { fileURLToPath } from "node:url";
import puppeteer from "puppeteer-core";

const PROTOCOL = 1;
const MOST_SUBPIXELS = 16; // a side: 256 samples
const MOST_POINT_LIGHTS = 8; // each takes one of the 16 textures that a shader is sure to have

const THREE_FOLDER = new URL(".", import.meta.resolve("three"));
const VERSION = JSON.parse(readFileSync(new URL("../package.json", THREE_FOLDER), "utf8")).version;

// ---------------------------------------------------------------------------------------------------------------- materials

const parameter = (kind, name, role, fallback, [min, max], more) =>
  ({ name, role, kind, default: fallback, valid: { min, max, open: false }, ...more });
const share = (name, role, fallback = 0) => parameter("number", name, role, fallback, [0, 1]);
const colour = (name, role, fallback) => parameter("colour", name, role, Array(3).fill(fallback), [0, 1]);

const COLOUR = colour("color", "base-colour", 0.5);
const METALNESS = share("metalness", "metalness");
const ROUGHNESS = parameter("number", "roughness", "perceptual-roughness", 0.5, [0, 1], {
  search: { min: 0, max: 1, step: 0.02 }, survey: { min: 0.1, max: 1, step: 0.05 } });

const MODELS = [
  {
    name: "physical",
    title: "MeshPhysicalMaterial",
    summary: "glTF metallic-roughness with clear coat, sheen and anisotropy, without transmission.",
    reference: "GGX, Schlick, Fdez-Agüera 2019; diffuse Portsmouth et al. 2025",
    surveyed: ["ior", "roughness"],
    searched: ["ior", "roughness"],
    parameters: [
      COLOUR, METALNESS, ROUGHNESS,
      parameter("number", "ior", "refractive-index", 1.5, [1, 2.333], {
        search: { min: 1, max: 2.3, step: 0.02 }, survey: { min: 1.1, max: 2.3, step: 0.1 } }),
      share("specularIntensity", "specular-reflectance", 1),
      colour("specularColor", "specular-colour", 1),
      share("diffuseRoughness", "diffuse-roughness"),
      share("clearcoat", "coat"),
      share("clearcoatRoughness", "coat-roughness"),
      share("sheen", "sheen"),
      colour("sheenColor", "sheen-colour", 1),
      share("sheenRoughness", "sheen-roughness", 0.5),
      share("anisotropy", "anisotropy"),
    ],
  },
  {
    name: "standard",
    title: "MeshStandardMaterial",
    summary: "glTF metallic-roughness; the dielectric has an index of 1.5.",
    surveyed: ["metalness", "roughness"],
    searched: ["roughness"],
    parameters: [COLOUR, METALNESS, ROUGHNESS],
  },
  {
    name: "lambert",
    title: "MeshLambertMaterial",
    summary: "Perfectly diffuse.",
    has_fresnel: false,
    surveyed: ["color"],
    searched: ["color"],
    parameters: [{ ...COLOUR, role: "diffuse-reflectance" }],
  },
];

const defaults = (model) => Object.fromEntries(model.parameters.map((one) => [one.name, one.default]));

const HELLO = {
  protocol: PROTOCOL,
  name: "threejs",
  version: VERSION,
  licence: "MIT",
  models: MODELS,
  capabilities: {
    deterministic: "exact",
    seeds: false,
    noise: false,
    samples: `the picture is drawn at k x k places within a pixel, k = the square root rounded, from 1 to ${MOST_SUBPIXELS}; more only smooth edges`,
    lights: ["point", "environment"],
    threads: "all",
    cancel: false,
    interreflection: false,
  },
  check: {
    lambert: { model: "lambert", values: {}, parameter: "color" },
    mirror: { model: "physical", values: { ...defaults(MODELS[0]), color: [1, 1, 1], metalness: 1, roughness: 0 } },
  },
  approximations: [
    "The environment lights by the split-sum approximation: its picture is blurred beforehand (PMREM, 512 pixels a face) for light and view along the normal, so that reflections do not stretch at grazing angles; a Lambert ball is off by up to 4 % under a map of large patches, by more under a small sun.",
    "Nothing is in the way of the environment: the plane lies without shade below the sphere.",
    "Sphere and plane do not see each other: neither is reflected in, nor lit by, the other.",
    "Roughness and clearcoatRoughness below 0.045 are 0.045, and the prefiltered environment has no finer pixels: mirrors are blurred.",
    "Anisotropy under the environment only bends the direction of the reflection.",
    "Under point lights the diffuse term loses Schlick's reflectance at the half vector, under the environment the specular albedo: the two differ.",
    "Shadows of point lights come from cube maps of 2048 pixels a face, with hard and slightly displaced edges.",
  ],
};

// ------------------------------------------------------------------------------------------------- what runs within the page

/** Sets up three.js in the page and leaves `worker` there. Runs in Chromium: it sees nothing else of this file. */
async function setUpPage() {
  const THREE = await import("/three.module.js");
  const SHADOW_SIZE = 2048; // pixels on a side of a face
  const ENVIRONMENT_SIZE = 512; // three's own choice for a map of 2048 pixels; takes four times as long as 256
  const HALF_FLOAT_LIMIT = 60000;

  const chunks = THREE.ShaderChunk;
  const pristine = chunks.lights_physical_fragment;
  chunks.lights_physical_fragment = pristine.replace(/float geometryRoughness = .*;/, "float geometryRoughness = 0.0;");
  if (chunks.lights_physical_fragment === pristine) throw new Error("this version of three.js widens roughness in another way");

  const renderer = new THREE.WebGLRenderer({ canvas: new OffscreenCanvas(1, 1), antialias: false });
  renderer.toneMapping = THREE.NoToneMapping;
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = THREE.BasicShadowMap;
  renderer.shadowMap.autoUpdate = false;
  renderer.autoClear = false;
  renderer.setClearColor(0, 1);

  const scenes = new Map();
  const materials = {
    physical: new THREE.MeshPhysicalMaterial(),
    standard: new THREE.MeshStandardMaterial(),
    lambert: new THREE.MeshLambertMaterial(),
  };
  for (const material of Object.values(materials)) material.shadowSide = THREE.FrontSide;
  let material = materials.lambert;
  let received = [];

  /** The map seen from within: a box whose fragments look up their own direction, the mean of taps x taps within the fragment. */
  function makeSky(texture) {
    const sky = new THREE.Mesh(new THREE.BoxGeometry(2, 2, 2), new THREE.ShaderMaterial({
      side: THREE.BackSide, depthTest: false, depthWrite: false, toneMapped: false,
      uniforms: { map: { value: texture }, taps: { value: 1 }, scale: { value: 1 } },
      vertexShader: `
        varying vec3 along;
        void main() {
          along = position;
          gl_Position = projectionMatrix * vec4(mat3(viewMatrix) * position, 1.0);
        }`,
      fragmentShader: `
        varying vec3 along;
        uniform sampler2D map;
        uniform int taps;
        uniform float scale;
        vec3 look(vec3 direction) {
          vec3 d = normalize(direction);
          return textureLod(map, vec2(atan(d.x, -d.z) / 6.283185307179586, acos(d.y) / 3.141592653589793), 0.0).rgb;
        }
        void main() {
          vec3 right = dFdx(along), up = dFdy(along), sum = vec3(0.0);
          for (int y = 0; y < taps; y++)
            for (int x = 0; x < taps; x++) {
              vec2 offset = (vec2(x, y) + 0.5) / float(taps) - 0.5;
              sum += look(along + offset.x * right + offset.y * up);
            }
          gl_FragColor = vec4(sum * scale / float(taps * taps), 1.0);
        }`,
    }));
    sky.frustumCulled = false;
    sky.renderOrder = -1;
    return sky;
  }

  function environmentTexture({ width, height }, pixels) {
    const rgba = new Float32Array(4 * width * height);
    for (let from = 0, to = 0; from < pixels.length; from += 3, to += 4)
      for (let channel = 0; channel < 3; channel++) rgba[to + channel] = pixels[from + channel];
    const texture = new THREE.DataTexture(rgba, width, height, THREE.RGBAFormat, THREE.FloatType);
    texture.minFilter = texture.magFilter = THREE.LinearFilter;
    texture.wrapS = THREE.RepeatWrapping; // atan is negative in the left half of the map
    texture.needsUpdate = true;
    return texture;
  }

  /** Lights the scene with the map, and shows it behind everything. */
  function addEnvironment(scene, size, pixels) {
    const sky = makeSky(environmentTexture(size, pixels));
    const { taps, scale } = sky.material.uniforms;
    const brightest = pixels.reduce((most, value) => Math.max(most, value), 0);
    scene.environmentIntensity = Math.max(1, brightest / HALF_FLOAT_LIMIT);

    taps.value = 4;
    scale.value = 1 / scene.environmentIntensity;
    const generator = new THREE.PMREMGenerator(renderer);
    const capture = new THREE.Scene().add(sky);
    const prefiltered = generator.fromScene(capture, 0, 0.1, 10, { size: ENVIRONMENT_SIZE });
    scene.environment = prefiltered.texture;
    // Reading a pixel waits for all of it: else the first picture would be charged with it.
    renderer.readRenderTargetPixels(prefiltered, 0, 0, 1, 1, new Uint16Array(4), 0);
    generator.dispose();

    taps.value = scale.value = 1;
    scene.add(sky);
  }

  /** A sphere with tangents to the east (for anisotropy); at this fineness its outline is within 1e-4 of the radius. */
  function sphereGeometry() {
    const geometry = new THREE.SphereGeometry(1, 256, 128);
    const uv = geometry.attributes.uv;
    const tangents = new Float32Array(4 * uv.count);
    for (let vertex = 0; vertex < uv.count; vertex++) {
      // three's longitude begins at -X and goes by +Z.
      const longitude = 2 * Math.PI * uv.getX(vertex);
      tangents.set([Math.sin(longitude), 0, Math.cos(longitude), 1], 4 * vertex);
    }
    return geometry.setAttribute("tangent", new THREE.BufferAttribute(tangents, 4));
  }
  const unitSphere = sphereGeometry();

  function makePlane({ height, half_extent, check_size, light, dark }) {
    // One texel for a check, repeated: texel (0, 0) is the check at 0 < x, z < check_size.
    const texels = new Float32Array([...light, 1, ...dark, 1, ...dark, 1, ...light, 1]);
    const map = new THREE.DataTexture(texels, 2, 2, THREE.RGBAFormat, THREE.FloatType);
    map.wrapS = map.wrapT = THREE.RepeatWrapping;
    map.needsUpdate = true;
    // In many parts: SwiftShader gets the depth of a large triangle wrong whose corner lies in the plane of a camera.
    const geometry = new THREE.PlaneGeometry(2 * half_extent, 2 * half_extent, 64, 64).rotateX(-Math.PI / 2).translate(0, height, 0);
    const { position, uv } = geometry.attributes;
    for (let corner = 0; corner < position.count; corner++)
      uv.setXY(corner, position.getX(corner) / (2 * check_size), position.getZ(corner) / (2 * check_size));
    return new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ map, side: THREE.DoubleSide, shadowSide: THREE.DoubleSide }));
  }

  function makeLight({ position, intensity }, spheres, plane) {
    const light = new THREE.PointLight(new THREE.Color(...intensity), 1, 0, 2);
    light.position.set(...position);
    const toSpheres = Math.max(0, ...spheres.map(({ centre, radius }) => light.position.distanceTo(new THREE.Vector3(...centre)) + radius));
    const toPlane = plane ? light.position.distanceTo(new THREE.Vector3(0, plane.height, 0)) + Math.SQRT2 * plane.half_extent : 0;
    const { shadow } = light;
    light.castShadow = true;
    shadow.mapSize.set(SHADOW_SIZE, SHADOW_SIZE);
    shadow.camera.far = 1.01 * Math.max(toSpheres, toPlane);
    shadow.camera.near = shadow.camera.far / 1000;
    // A face spans 2 x distance; half as much again for the diagonal of a texel.
    shadow.normalBias = 1.5 * 2 * toSpheres / SHADOW_SIZE;
    return light;
  }

  function makeCamera({ eye, target, up, vertical_fov }) {
    const distance = new THREE.Vector3(...eye).distanceTo(new THREE.Vector3(...target));
    const camera = new THREE.PerspectiveCamera(vertical_fov, 1, distance / 1000, distance * 1000);
    camera.position.set(...eye);
    camera.up.set(...up);
    camera.lookAt(...target);
    return camera;
  }

  function dispose({ scene }) {
    scene.environment?.dispose();
    scene.traverse((object) => {
      if (object.isLight) object.shadow.map?.dispose();
      if (!object.isMesh || object.geometry === unitSphere) return;
      object.geometry.dispose();
      (object.material.map ?? object.material.uniforms?.map.value)?.dispose();
      object.material.dispose();
    });
  }

  function setScene(described) {
    const parts = received;
    received = [];
    const scene = new THREE.Scene();
    const { spheres, plane, point_lights: lights, environment } = described;
    const balls = spheres.map(({ centre, radius }) => {
      const ball = new THREE.Mesh(unitSphere, material);
      ball.position.set(...centre);
      ball.scale.setScalar(radius);
      ball.castShadow = ball.receiveShadow = true;
      return ball;
    });
    scene.add(...balls, ...lights.map((light) => makeLight(light, spheres, plane)));
    if (plane) {
      const ground = makePlane(plane);
      ground.receiveShadow = true;
      // From a light above it can only shade itself, for want of a larger bias.
      ground.castShadow = lights.some(({ position }) => position[1] < plane.height);
      scene.add(ground);
    }
    if (environment) {
      const bytes = new Uint8Array(12 * environment.width * environment.height);
      parts.reduce((start, part) => (bytes.set(part, start), start + part.length), 0);
      addEnvironment(scene, environment, new Float32Array(bytes.buffer));
    }
    if (scenes.has(described.scene)) dispose(scenes.get(described.scene));
    scenes.set(described.scene, { scene, balls, camera: makeCamera(described.camera), size: described.size, shaded: false });
  }

  function setMaterial(model, values) {
    material = materials[model];
    for (const [name, value] of Object.entries(values))
      if (Array.isArray(value)) material[name].setRGB(...value);
      else material[name] = value;
  }

  const target = (size, depthBuffer) => new THREE.WebGLRenderTarget(size, size, {
    type: THREE.FloatType, depthBuffer, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter });

  // Adds a weighted picture to the sum of those before it.
  const adder = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), new THREE.ShaderMaterial({
    depthTest: false, depthWrite: false, transparent: true, toneMapped: false,
    blending: THREE.CustomBlending, blendSrc: THREE.OneFactor, blendDst: THREE.OneFactor,
    uniforms: { picture: { value: null }, weight: { value: 1 } },
    vertexShader: "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }",
    fragmentShader: `
      uniform sampler2D picture;
      uniform float weight;
      void main() { gl_FragColor = weight * texelFetch(picture, ivec2(gl_FragCoord.xy), 0); }`,
  }));
  adder.frustumCulled = false;

  function draw(into, what, camera) {
    renderer.setRenderTarget(into);
    renderer.render(what, camera);
  }

  /** Mean of `side` x `side` pictures, each shifted by a part of a pixel: RGB from the top row, in base 64; null if graphics are lost. */
  function render(name, side) {
    const kept = scenes.get(name);
    const { scene, balls, camera, size } = kept;
    for (const ball of balls) ball.material = material;
    renderer.shadowMap.needsUpdate = !kept.shaded; // shadows depend on nothing but the scene
    kept.shaded = true;

    const picture = target(size, true);
    const sum = target(size, false);
    adder.material.uniforms.picture.value = picture.texture;
    adder.material.uniforms.weight.value = 1 / (side * side);
    renderer.setRenderTarget(sum);
    renderer.setClearAlpha(0);
    renderer.clear();
    renderer.setClearAlpha(1);
    for (let place = 0; place < side * side; place++) {
      const x = ((place % side) + 0.5) / side - 0.5;
      const y = (Math.floor(place / side) + 0.5) / side - 0.5;
      camera.setViewOffset(size, size, x, y, size, size);
      renderer.setRenderTarget(picture);
      renderer.clear();
      draw(picture, scene, camera);
      draw(sum, adder, camera);
    }
    const pixels = new Float32Array(4 * size * size);
    renderer.readRenderTargetPixels(sum, 0, 0, size, size, pixels);
    picture.dispose();
    sum.dispose();
    // All that is drawn is opaque. A graphics process that died leaves zeros, and says so only later.
    return pixels[3] > 0.5 ? topDown(pixels, size) : null;
  }

  function topDown(rgba, size) {
    const rgb = new Float32Array(3 * size * size);
    for (let row = 0; row < size; row++)
      for (let column = 0; column < size; column++) {
        const from = 4 * ((size - 1 - row) * size + column);
        rgb.set(rgba.subarray(from, from + 3), 3 * (row * size + column));
      }
    return new Uint8Array(rgb.buffer).toBase64();
  }

  globalThis.worker = {
    receive: (base64) => void received.push(Uint8Array.fromBase64(base64)),
    setScene, setMaterial, render,
  };
}

// ------------------------------------------------------------------------------------------------------------------- Chromium

function findChromium() {
  if (process.env.LOOKMATCH_CHROMIUM) return process.env.LOOKMATCH_CHROMIUM;
  for (const name of ["chromium", "chromium-browser", "google-chrome"])
    for (const folder of (process.env.PATH ?? "").split(delimiter)) {
      try {
        accessSync(join(folder, name), constants.X_OK);
        return join(folder, name);
      } catch {}
    }
  throw new Error("no chromium, chromium-browser or google-chrome in PATH: install one, or name it in LOOKMATCH_CHROMIUM");
}

/**
 * A shell that waits for our end, however we end, then ends Chromium's process group, whose number it is told in a line, and removes
 * its profile. By itself Chromium takes seconds to notice that we are gone, and those who kill us leave us no time to clean up.
 */
function startUndertaker(profile) {
  const script = 'read group; cat; kill -s KILL -- "-$group"; sleep 1; rm -rf "$0"';
  const undertaker = spawn("sh", ["-c", script, profile], { stdio: ["pipe", "ignore", "ignore"], detached: true });
  undertaker.unref();
  undertaker.stdin.unref();
  return undertaker.stdin;
}

async function startChromium() {
  const executablePath = findChromium();
  const userDataDir = mkdtempSync(join(tmpdir(), "lookmatch-threejs-"));
  const undertaker = startUndertaker(userDataDir);
  const browser = await puppeteer.launch({
    executablePath,
    userDataDir,
    pipe: true, // Chromium ends when we do
    protocolTimeout: 0, // lookmatch knows how long it wants to wait
    args: [
      "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-watchdog",
      "--no-sandbox", // it does not work as root or in containers, and the page is our own
      "--disable-background-networking", "--disable-component-update", "--disable-sync", "--no-first-run", "--disable-quic",
      "--host-resolver-rules=MAP * ~NOTFOUND",
    ],
  }).catch((failure) => {
    throw new Error(`${executablePath} did not start: ${failure.message}`);
  });
  undertaker.write(`${browser.process().pid}\n`);
  browser.on("disconnected", () => stop("Chromium ended"));
  const page = (await browser.pages())[0];
  page.on("console", (message) => message.type() === "error" && console.error("page:", message.text()));
  await page.setRequestInterception(true);
  page.on("request", answerFromDisk);
  await page.goto("http://three.invalid/");
  await page.evaluate(setUpPage);
  const inspector = await browser.target().createCDPSession();
  return { page, inspector };
}

function answerFromDisk(request) {
  const name = new URL(request.url()).pathname.slice(1);
  if (name === "") request.respond({ contentType: "text/html", body: "<!doctype html><link rel=icon href=data:,>" });
  else if (/^three\.\w+\.js$/.test(name))
    request.respond({ contentType: "text/javascript", body: readFileSync(fileURLToPath(new URL(name, THREE_FOLDER))) });
  else request.abort();
}

/** Seconds of CPU of all of Chromium's processes since they began. */
async function cpuSeconds(inspector) {
  const { processInfo } = await inspector.send("SystemInfo.getProcessInfo");
  return processInfo.reduce((sum, one) => sum + one.cpuTime, 0);
}

// -------------------------------------------------------------------------------------------------------------------- requests

class Refused extends Error {}

const sizes = new Map(); // of the pictures of each scene
const PART = 24 * 2 ** 20; // Chromium reads at most 100 MB in one message

/** One function for each request: returns the answer's fields, and perhaps its bytes. */
const requests = {
  async hello({ protocol }) {
    if (protocol !== PROTOCOL) throw new Refused(`this worker speaks version ${PROTOCOL} of the protocol, not ${protocol}`);
    await chromium;
    return [HELLO];
  },

  async scene(request, environment) {
    const { scene, size, camera, spheres, plane, point_lights } = request;
    if (point_lights.length > MOST_POINT_LIGHTS)
      throw new Refused(`point_lights: at most ${MOST_POINT_LIGHTS}, not ${point_lights.length}`);
    if (size > 4096) throw new Refused(`size: at most 4096, not ${size}`);
    const { page } = await chromium;
    for (let start = 0; start < environment.length; start += PART)
      await page.evaluate((part) => worker.receive(part), environment.subarray(start, start + PART).toString("base64"));
    const described = { scene, size, camera, spheres, plane, point_lights, environment: request.environment };
    await page.evaluate((described) => worker.setScene(described), described);
    sizes.set(scene, size);
    return [{}];
  },

  async material({ model, values }) {
    const known = MODELS.find(({ name }) => name === model);
    if (!known) throw new Refused(`unknown model '${model}'; known are ${MODELS.map(({ name }) => name).join(", ")}`);
    for (const { name } of known.parameters) if (!(name in values)) throw new Refused(`${model}: '${name}' is missing`);
    const own = Object.fromEntries(known.parameters.map(({ name }) => [name, values[name]]));
    const { page } = await chromium;
    await page.evaluate((model, values) => worker.setMaterial(model, values), model, own);
    return [{}];
  },

  async render({ scene, samples }) {
    const size = sizes.get(scene);
    if (size === undefined) throw new Refused(`unknown scene '${scene}'; known are ${[...sizes.keys()].join(", ") || "none"}`);
    const side = Math.min(Math.max(Math.round(Math.sqrt(samples)), 1), MOST_SUBPIXELS);
    const { page, inspector } = await chromium;
    const [cpu, wall] = [await cpuSeconds(inspector), performance.now()];
    const picture = await page.evaluate((scene, side) => worker.render(scene, side), scene, side);
    if (picture === null) await stop("Chromium lost its graphics");
    const wall_s = (performance.now() - wall) / 1000;
    const cpu_s = (await cpuSeconds(inspector)) - cpu;
    return [{ width: size, height: size, samples: side * side, cpu_s, wall_s }, Buffer.from(picture, "base64")];
  },

  async shutdown() {
    return [{}];
  },
};

// -------------------------------------------------------------------------------------------------------------------- protocol

// Nothing but answers may appear on standard output.
console.log = console.info = console.error;

let current; // id of the request being answered
let stopping = false;

/** Writes a JSON line and the bytes that follow it; returns once they are on their way. */
function send(message, bytes = Buffer.alloc(0)) {
  if (bytes.length) message.bytes = bytes.length;
  const packet = Buffer.concat([Buffer.from(JSON.stringify(message) + "\n"), bytes]);
  return new Promise((sent) => process.stdout.write(packet, sent));
}

/** Ends a worker that can do no more. */
async function stop(why) {
  stopping = true;
  console.error(`threejs: ${why}`);
  if (current !== undefined) await send({ id: current, error: why });
  process.exit(1);
}

async function answer(request, bytes) {
  current = request.id;
  try {
    const handler = Object.hasOwn(requests, request.request) ? requests[request.request] : undefined;
    if (!handler) throw new Refused(`unknown request '${request.request}'; known are ${Object.keys(requests).join(", ")}`);
    const [fields, data] = await handler(request, bytes);
    await send({ id: request.id, ...fields }, data);
  } catch (failure) {
    if (stopping) return; // it has been answered
    if (!(failure instanceof Refused)) console.error(failure);
    await send({ id: request.id, error: failure.message });
  }
  current = undefined;
  if (request.request === "shutdown") process.exit(0);
}

/** Calls `found` with each request and its bytes, as they arrive. */
function readRequests(found) {
  let request; // whose bytes are awaited
  let parts = []; // of its line, then of its bytes
  let missing = 0;
  process.stdin.on("data", (chunk) => {
    while (chunk.length || (request && missing === 0)) {
      if (!request) {
        const end = chunk.indexOf(10);
        parts.push(end < 0 ? chunk : chunk.subarray(0, end));
        if (end < 0) return;
        request = JSON.parse(Buffer.concat(parts).toString());
        [parts, missing, chunk] = [[], request.bytes ?? 0, chunk.subarray(end + 1)];
      }
      const part = chunk.subarray(0, missing);
      parts.push(part);
      missing -= part.length;
      chunk = chunk.subarray(part.length);
      if (missing === 0) {
        found(request, Buffer.concat(parts));
        [request, parts] = [undefined, []];
      }
    }
  });
}

const chromium = startChromium();
chromium.catch(() => {}); // reported to whoever waits for it

let last = Promise.resolve();
readRequests((request, bytes) => (last = last.then(() => answer(request, bytes))));
// lookmatch is gone: in the middle of a render too.
process.stdin.on("end", () => process.exit(0));
process.stdout.on("error", () => process.exit(0));
