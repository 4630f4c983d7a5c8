// Draws a chart's scene with vtk.js (https://kitware.github.io/vtk-js) in headless Chromium, and times it.
//
//   mkdir -p ../vtkjs && npm install --prefix ../vtkjs @kitware/vtk.js playwright-core esbuild
//   apt-get install -y --no-install-recommends chromium
//   node benches/peers/vtkjs_chart.mjs --packages ../vtkjs FOLDER
//
// FOLDER holds scene.json and the volumes it names, and gets vtkjs_{mode}_{k}.png for volume k.
// Standard output gets a JSON line per mode: settings, images, and milliseconds. Options:
//   --packages FOLDER   where the packages are installed (the current folder)
//   --chromium FILE     the browser (/usr/bin/chromium)
//   --angle NAME        what draws below WebGL: swiftshader (on the processor), vulkan, gl, ...
//   --modes A,B         only these modes
//   --times N           how often each time is taken (10)
//   --repair            repairs two faults of vtk.js' shader, listed at `repairs` below
//
// The pictures hold vtk.js' levels as they are. They are linear, as the scene's colours: encode them for a display.

import fs from "node:fs";
import http from "node:http";
import { createRequire } from "node:module";
import path from "node:path";
import { parseArgs } from "node:util";

// Every mode has light from the camera. `reach` stands for the scene's reach, in samples.
const look = { shade: true, ambient: 0.2, diffuse: 0.8, specular: 0 };
const occlusion = { ...look, localAmbientOcclusion: true };
const widest = { ...occlusion, LAOKernelSize: 32, LAOKernelRadius: "reach" };
const scattering = { ...look, volumetricScatteringBlending: 1, globalIlluminationReach: 1 };
// Blending of exactly 1 leaves surface shading out, and mixes shadows with unlit colours.
const mixed = { ...scattering, volumetricScatteringBlending: 0.999 };
const modes = {
  phong: { property: look },
  lao: { property: occlusion }, // vtk.js' defaults: 15 rays of 7 samples
  lao_best: { property: widest },
  lao_ambient: { property: { ...widest, ambient: 1, diffuse: 0 } }, // occlusion dims ambient light only
  scattering: { property: scattering },
  scattering_best: { property: mixed, mapper: { volumeShadowSamplingDistFactor: 1 } }, // the finest shadow rays
};

// Rays start on the box in place of a random place within a step. LAO and shadows keep their noise.
const noJitter = ["float jitter = 0.01 + 0.99 * fragmentSeed;", "const float jitter = 1.0;"];
const repairs = [
  // The directions of LAO's rays never reach the shader: all rays of a pixel are one ray.
  ["vec2 kernelSample[vtkMaxLaoKernelSize];", "uniform vec2 kernelSample[vtkMaxLaoKernelSize];"],
  // Normals are stretched by the volume's size along each axis, wrong where it is no cube.
  [
    "return volume.normalISToVCMatrix * normalIS;",
    "return volume.normalISToVCMatrix * (normalIS * volume.inverseSpacing * volume.inverseDimensions);",
  ],
];

function fail(message) {
  console.error(message);
  process.exit(1);
}

/** Reads scene.json and checks the volumes' sizes and the motion. */
function readScene(folder) {
  const file = path.join(folder, "scene.json");
  let scene;
  try {
    scene = JSON.parse(fs.readFileSync(file, "utf8"));
  } catch (error) {
    fail(`${file}: ${error.message}`);
  }
  const needed = "volumes dimensions spacing_mm world_from_grid points opacity_unit_mm step_mm reach_mm camera pixels";
  for (const key of needed.split(" ")) if (!scene[key]) fail(`${file}: "${key}" is missing`);
  const cameraKeys = "position focal_point up fov_degrees".split(" ");
  for (const key of cameraKeys) if (!scene.camera[key]) fail(`${file}: "${key}" of "camera" is missing`);
  const bytes = 2 * scene.dimensions.reduce((product, n) => product * n);
  for (const name of scene.volumes) {
    const size = fs.statSync(path.join(folder, name), { throwIfNoEntry: false })?.size;
    if (size === undefined) fail(`${path.join(folder, name)}: no such file`);
    if (size !== bytes) fail(`${path.join(folder, name)}: ${size} bytes, where "dimensions" make ${bytes}`);
  }
  const axis = (i) => [0, 4, 8].map((row) => scene.world_from_grid[row + i]);
  for (const [i, j] of [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]]) {
    const dot = axis(i).reduce((sum, a, k) => sum + a * axis(j)[k], 0);
    if (!(Math.abs(dot - (i === j)) < 1e-4)) fail(`${file}: "world_from_grid" is no rigid motion`);
  }
  return scene;
}

// The parts of vtk.js that the page sees, as `vtk`.
const parts = `
  import "@kitware/vtk.js/Rendering/Profiles/Volume";
  export { default as Core } from "@kitware/vtk.js/Rendering/Core";
  export { default as Window } from "@kitware/vtk.js/Rendering/OpenGL/RenderWindow";
  export { default as shader } from "@kitware/vtk.js/Rendering/OpenGL/glsl/vtkVolumeFS.glsl";
  export { default as DataArray } from "@kitware/vtk.js/Common/Core/DataArray";
  export { default as ImageData } from "@kitware/vtk.js/Common/DataModel/ImageData";
  export { default as PiecewiseFunction } from "@kitware/vtk.js/Common/DataModel/PiecewiseFunction";`;

/** Serves the page, its script and the volumes to this machine only. */
async function serve(script, folder, names) {
  const server = http.createServer((request, response) => {
    const name = decodeURIComponent(request.url.slice(1));
    if (names.includes(name)) return fs.createReadStream(path.join(folder, name)).pipe(response);
    response.setHeader("content-type", name === "vtk.js" ? "text/javascript" : "text/html");
    response.end(name === "vtk.js" ? script : '<link rel="icon" href="data:,"><script src="vtk.js"></script>');
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  return server;
}

/** Runs in the page: draws every volume in one mode, then takes times. */
async function draw({ scene, mode, replacements, times }) {
  const { Core, DataArray, ImageData, PiecewiseFunction, shader, Window } = globalThis.vtk;
  // A fixed sequence makes pictures repeatable: vtk.js' noise comes from here.
  let state = 1;
  Math.random = () => (state = (state * 48271) % 2147483647) / 2147483647;

  const volumes = await Promise.all(
    scene.volumes.map(async (name) => new Uint16Array(await (await fetch(encodeURIComponent(name))).arrayBuffer())),
  );
  const m = scene.world_from_grid;
  const image = ImageData.newInstance({ spacing: scene.spacing_mm, origin: [m[3], m[7], m[11]] });
  image.setDimensions(scene.dimensions);
  image.setDirection(m[0], m[4], m[8], m[1], m[5], m[9], m[2], m[6], m[10]); // the axes one after another
  const hand = (k) => {
    image.getPointData().setScalars(DataArray.newInstance({ values: volumes[k], numberOfComponents: 1 }));
    image.modified();
  };
  hand(0);

  const mapper = Core.vtkVolumeMapper.newInstance({
    sampleDistance: scene.step_mm,
    autoAdjustSampleDistances: false,
    maximumSamplesPerRay: Infinity, // it is only where a warning starts
    ...mode.mapper,
  });
  for (const [originalValue] of replacements) {
    if (!shader.includes(originalValue)) throw new Error(`vtkVolumeFS.glsl lacks "${originalValue}"`);
  }
  mapper.getViewSpecificProperties().OpenGL = {
    ShaderReplacements: replacements.map(([originalValue, replacementValue]) => {
      return { shaderType: "Fragment", replaceFirst: true, replaceAll: false, originalValue, replacementValue };
    }),
  };
  mapper.setInputData(image);

  const opacity = PiecewiseFunction.newInstance({ allowDuplicateScalars: true });
  const colour = Core.vtkColorTransferFunction.newInstance({ allowDuplicateScalars: true });
  const setPoints = (shift) => {
    for (const f of [opacity, colour]) f.removeAllPoints();
    scene.points.forEach((point, index) => {
      const value = point.value + (index === 0 ? shift : 0);
      opacity.addPoint(value, point.opacity);
      colour.addRGBPoint(value, ...point.color);
    });
  };
  setPoints(0);
  const volume = Core.vtkVolume.newInstance();
  volume.setMapper(mapper);
  const property = volume.getProperty();
  property.setScalarOpacity(0, opacity);
  property.setRGBTransferFunction(0, colour);
  property.setScalarOpacityUnitDistance(0, scene.opacity_unit_mm);
  property.setInterpolationTypeToLinear();
  property.set(mode.property);

  const camera = Core.vtkCamera.newInstance();
  camera.setPosition(...scene.camera.position);
  camera.setFocalPoint(...scene.camera.focal_point);
  camera.setViewUp(...scene.camera.up);
  camera.setViewAngle(scene.camera.fov_degrees);
  const renderer = Core.vtkRenderer.newInstance({ background: [0, 0, 0] });
  renderer.setActiveCamera(camera);
  renderer.addVolume(volume);
  renderer.resetCameraClippingRange();
  const renderWindow = Core.vtkRenderWindow.newInstance();
  renderWindow.addRenderer(renderer);
  const view = Window.newInstance();
  view.setContainer(document.body);
  view.setSize(...scene.pixels);
  renderWindow.addView(view);
  const interactor = Core.vtkRenderWindowInteractor.newInstance(); // the mapper asks it whether the view is moving
  interactor.setView(view);
  interactor.initialize();

  const gl = view.get3DContext();
  const pixel = new Uint8Array(4);
  const time = (change) => {
    const start = performance.now();
    change();
    renderWindow.render();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel); // waits until all is drawn
    return Number((performance.now() - start).toFixed(1));
  };
  const images = volumes.map((_, k) => {
    time(() => hand(k));
    return view.getCanvas().toDataURL("image/png");
  });
  const ms = { carve: [], rest: [], edit: [] };
  for (let n = 0; n < times; n++) {
    ms.carve.push(time(() => hand(n % volumes.length)));
    ms.rest.push(time(() => {}));
    ms.edit.push(time(() => setPoints(n % 2 ? 0 : 0.01)));
  }
  if (gl.isContextLost()) throw new Error("the WebGL context was lost");
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  return { images, ms, gl: gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER) };
}

const text = (standard) => ({ type: "string", default: standard });
const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    packages: text("."),
    chromium: text("/usr/bin/chromium"),
    angle: text("swiftshader"),
    modes: text(Object.keys(modes).join()),
    times: text("10"),
    repair: { type: "boolean", default: false },
  },
});
const [folder] = positionals;
if (positionals.length !== 1) fail("usage: node vtkjs_chart.mjs [options] FOLDER");
const chosen = options.modes.split(",");
for (const name of chosen) if (!modes[name]) fail(`--modes: "${name}" is none of ${Object.keys(modes).join(", ")}`);
const times = Number(options.times);
if (!Number.isInteger(times) || times < 0) fail(`--times: "${options.times}" is no count`);
const scene = readScene(folder);
const packages = path.resolve(options.packages);
const require = createRequire(path.join(packages, "package.json"));
const load = (name) => {
  try {
    return require(name);
  } catch (error) {
    return fail(`${packages}: ${name} is not installed there (${error.code ?? error.message})`);
  }
};
const { version } = load("@kitware/vtk.js/package.json");
const bundled = await load("esbuild").build({
  stdin: { contents: parts, resolveDir: packages },
  bundle: true,
  globalName: "vtk",
  logLevel: "error",
  write: false,
});
const server = await serve(bundled.outputFiles[0].text, folder, scene.volumes);

const quiet = ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"];
const draws = [`--use-angle=${options.angle}`, "--use-gl=angle", "--ignore-gpu-blocklist", "--disable-gpu-watchdog"];
const browser = await load("playwright-core")
  .chromium.launch({
    executablePath: options.chromium,
    args: [...quiet, "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader", ...draws],
  })
  .catch((error) => fail(`${options.chromium}: ${error.message}`));

for (const name of chosen) {
  const mode = structuredClone(modes[name]);
  const reach = Math.max(1, Math.round(scene.reach_mm / scene.step_mm));
  if (mode.property.LAOKernelRadius === "reach") mode.property.LAOKernelRadius = reach;
  const replacements = options.repair ? [noJitter, ...repairs] : [noJitter];
  const line = { peer: `vtk.js ${version}`, mode: name, repaired: options.repair };
  const page = await browser.newPage({ deviceScaleFactor: 1 });
  try {
    const errors = [];
    page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
    page.on("pageerror", (error) => errors.push(error.message));
    await page.goto(`http://127.0.0.1:${server.address().port}/`);
    const { images, ms, gl } = await page.evaluate(draw, { scene, mode, replacements, times });
    if (errors.length) throw new Error(errors.at(-1)); // the shader's text comes first, its fault last
    Object.assign(line, { gl, settings: { ...mode.property, ...mode.mapper }, ms });
    line.images = images.map((url, k) => {
      const file = `vtkjs_${name}_${k}.png`;
      fs.writeFileSync(path.join(folder, file), Buffer.from(url.split(",")[1], "base64"));
      return file;
    });
  } catch (error) {
    line.unsupported = error.message;
  }
  console.log(JSON.stringify(line));
  await page.close();
}
await browser.close();
server.close();
