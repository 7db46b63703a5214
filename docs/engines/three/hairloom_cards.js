// Draws hair cards exported by Hairloom in three.js (r160 or later).
//
//     const hair = await loadHairloomCards('hair.glb');
//     scene.add(hair);
//
// Reads NAME.glb, NAME.hairloom.json and the textures next to them. Uses the lights of the scene:
// ambient light, suns (DirectionalLight) and lamps (PointLight), and its fog. Shadows are left to you.
// Joints that were exported move the hair: new AnimationMixer(hair).clipAction(hair.animations[0]);
// springs do with @pixiv/three-vrm-springbone: plugins: [(parser) => new VRMSpringBoneLoaderPlugin(parser)],
// and each frame hair.userData.vrmSpringBoneManager.update(1 / 60).
import * as THREE from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import SHADING from './hair_shading.js';

// name -> value used if the sidecar has no such texture
const TEXTURES = { base: 255, alpha: 255, shift: 128, noise: 255, tangent: 128, normal: 128 };
const TABLES = ['longitudinal', 'azimuthal', 'paths'];
const REPEATED = ['shift', 'noise'];
const OWN_TEXTURES = [...Object.keys(TEXTURES).map((name) => `${name}_texture`), ...TABLES];

// of a distance, without cross-fade: nothing flickers where a level takes over
const HYSTERESIS = 0.05;

const VERSION = 2;
const REMEDY = 'use the file that Hairloom wrote';
// the sidecar's levels give way to the next where that one is off by a pixel of this many lines
const SCREEN_HEIGHT = 1080;

// A THREE.LOD, each of whose levels takes over at its own distance from the middle of the hair. Around
// that distance two of them are drawn, each in the pixels that the other one leaves out.
export class HairLevels extends THREE.LOD {
  crossFade = 0.1; // of a distance, how wide these bands are; 0: levels change at once
  center = new THREE.Vector3();

  copy(source) {
    super.copy(source);
    this.crossFade = source.crossFade;
    this.center.copy(source.center);
    const others = source.children.filter((child) => source.levels.every(({ object }) => object !== child));
    this.add(...others.map((child) => child.clone())); // joints, to which SkeletonUtils.clone binds the levels
    return this;
  }

  addLevel(object, distance, hysteresis) {
    super.addLevel(object, distance, hysteresis);
    const level = this.levels.find((each) => each.object === object);
    level.parts = new WeakMap(); // camera -> part of the pixels, see hair_level_has
    object.children.forEach((mesh) => {
      // copies of a hair share their materials, and a mirror draws in the middle of another camera's picture
      mesh.onBeforeRender = (renderer, scene, camera, geometry, material) => {
        if (!material.uniforms?.part) return;
        material.uniforms.part.value.fromArray((this.autoUpdate && level.parts.get(camera)) || [0, 1]);
        material.uniformsNeedUpdate = true;
      };
    });
    return this;
  }

  update(camera) {
    const place = new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld);
    const away = place.distanceTo(this.center.clone().applyMatrix4(this.matrixWorld));
    const distance = away / (camera.zoom * this.matrixWorld.getMaxScaleOnAxis()); // as if hair were not scaled
    let share = 1; // how far this level has taken over from those before it
    this.levels.forEach((level, number) => {
      const next = this.levels[number + 1];
      const part = [next ? Math.min(share, this.shareOf(next, distance)) : 0, share];
      if (part[0] < 0.5 && share >= 0.5) this._currentLevel = number;
      for (const each of [camera, ...(camera.cameras ?? [])]) level.parts.set(each, part); // the eyes of a headset
      level.object.visible = part[0] < part[1];
      [share] = part;
    });
  }

  shareOf({ distance: begin, hysteresis, object }, distance) {
    if (!this.crossFade) return distance >= begin * (object.visible ? 1 - hysteresis : 1) ? 1 : 0;
    return THREE.MathUtils.clamp((distance / begin - 1) / this.crossFade + 0.5, 0, 1);
  }
}

// Options: level (0 the finest; without it a HairLevels shows each from the distance at which it takes
// over), fieldOfView (of the camera for which these distances are, in degrees), crossFade (see HairLevels; 0
// turns it off), addressOf (file name -> address, for files that lie elsewhere; without it they lie beside the
// GLB, and have the query of its address), plugins (for GLTFLoader.register; what they find is in userData),
// warn (gets a sentence for each thing that is wrong; what can be shown is shown).
export async function loadHairloomCards(
  url,
  { level, fieldOfView = 50, crossFade = 0.1, addressOf, plugins = [], warn = console.warn } = {},
) {
  const name = nameOf(url);
  addressOf ??= (file) => {
    const address = new URL(encodeURIComponent(file), addressBeside(url));
    address.search = addressBeside(url).search;
    return address.href;
  };
  const [sidecar, gltf] = await Promise.all([
    sidecarOf(name, addressOf, warn),
    gltfOf(name, addressOf, plugins),
  ]);
  const levels = sidecar?.levels.filter((each) => numberOf(gltf, each) >= 0) ?? [];
  const nodes = await Promise.all(
    // Coarser levels are no part of the scene (MSFT_lod), so the node is asked for by its number.
    levels.map((each) => gltf.parser.getDependency('node', numberOf(gltf, each))),
  );
  if (!nodes.length || !nodes.every((node) => node.isMesh)) {
    if (sidecar) warn(`${name}: its levels are not those of its sidecar; ${REMEDY}`);
    return gltf.scene; // in the plain material of the file
  }
  const isAsWritten = levels.map((each, number) => isWritten(nodes[number].geometry, each));
  if (!isAsWritten.every(Boolean)) {
    warn(`${name}: another program has changed it, so hair may show holes; ${REMEDY}`);
  }
  const uniforms = await uniformsOf(sidecar, addressOf, warn);
  const backs = await indicesOf(sidecar, addressOf, warn);
  const groupOf = (number) => {
    const backIndex = backs && isAsWritten[number] ? backIndexOf(backs, levels[number]) : null;
    const group = new THREE.Group();
    group.add(...passesOf(completed(nodes[number]), sidecar, backIndex, uniforms));
    return group;
  };
  const last = levels.length - 1;
  const hair = level === undefined ? new HairLevels() : groupOf(Math.min(level, last));
  if (level === undefined) {
    const begins = beginsOf(gltf, levels, fieldOfView);
    begins.forEach((begin, number) => hair.addLevel(groupOf(number), begin, HYSTERESIS));
    hair.crossFade = crossFade;
    boundsOf(levels[0]).getCenter(hair.center);
  }
  const root = gltf.scene.getObjectByName('hair_root');
  if (sidecar.motion && root) {
    gltf.scene.updateMatrixWorld(true);
    hair.attach(carrierOf(root)); // all levels are bound to its joints
    hair.animations = gltf.animations;
  }
  for (const [key, value] of Object.entries(gltf.userData)) {
    // three.js copies userData as JSON, and what a plug-in has made, such as springs, is no such data
    const enumerable = Object.hasOwn(gltf.parser.json.extras ?? {}, key);
    Object.defineProperty(hair.userData, key, { value, enumerable, writable: true, configurable: true });
  }
  return hair;
}

// Frees what the GPU holds of hair. Its copies share materials and textures with it.
export function disposeHairloomCards(hair) {
  hair.removeFromParent();
  hair.traverse(({ geometry, material, skeleton }) => {
    geometry?.dispose();
    skeleton?.dispose();
    if (!material) return;
    const own = OWN_TEXTURES.map((name) => material.uniforms?.[name]?.value);
    [...own, ...Object.values(material)].forEach((each) => { if (each?.isTexture) each.dispose(); });
    material.dispose();
  });
}

// The root joint, or the bone of a character below which it lies: that has the bone's place and axes.
function carrierOf(joint) {
  return joint.parent?.isBone ? carrierOf(joint.parent) : joint;
}

function addressBeside(url) {
  return new URL(url, document.baseURI);
}

// Of the file at an address. Any base does: a page may have none that is one, such as a blob.
function nameOf(url) {
  return decodeURIComponent(new URL(url, 'file:').pathname.split('/').pop());
}

// The sidecar of a GLB; null, with a sentence, where the file has to be shown without.
async function sidecarOf(name, addressOf, warn) {
  const file = name.replace(/\.glb$/i, '.hairloom.json');
  const plain = (what) => {
    warn(`${file}: ${what}. ${name} is shown in its plain material`);
    return null;
  };
  const answer = await fetch(addressOf(file)).catch(() => null);
  if (!answer?.ok) return plain('it is missing; copy all files of the export');
  const sidecar = await answer.json().catch(() => null);
  if (!sidecar?.levels?.length) return plain('it is no sidecar of Hairloom; export the cards again');
  if (sidecar.hairloom_sidecar > VERSION) return plain('a newer Hairloom wrote it; update this module');
  if (sidecar.file !== name) {
    warn(`${file}: it names ${sidecar.file}, not ${name}; rename both files back if the hair looks wrong`);
  }
  return sidecar;
}

async function gltfOf(name, addressOf, plugins) {
  try {
    const loader = plugins.reduce((made, plugin) => made.register(plugin), new GLTFLoader());
    return await loader.loadAsync(addressOf(name));
  } catch (error) {
    throw new Error(`${name}: it cannot be read (${error.message}); ${REMEDY}`);
  }
}

function numberOf(gltf, { node }) {
  return gltf.parser.json.nodes.findIndex(({ name }) => name === node);
}

// Whether triangles and vertices are those that Hairloom wrote, in their order.
function isWritten({ index, attributes }, { indices, indices_adler32: sum }) {
  if (!index || index.count !== indices || !attributes.uv1 || !attributes.tangent) return false;
  return sum === undefined || adler32(new Uint8Array(Uint32Array.from(index.array).buffer)) === sum;
}

function adler32(bytes) {
  let [low, high] = [1, 0];
  for (const byte of bytes) {
    low = (low + byte) % 65521;
    high = (high + low) % 65521;
  }
  return high * 65536 + low;
}

// What an optimiser has taken for unused: open to the light, at the root, any direction.
function completed(node) {
  const { geometry } = node;
  const { count } = geometry.attributes.position;
  for (const [name, values] of Object.entries({ uv1: [1, 0], tangent: [1, 0, 0, 1] })) {
    const all = Array.from({ length: count }, () => values).flat();
    if (!geometry.attributes[name]) {
      geometry.setAttribute(name, new THREE.Float32BufferAttribute(all, values.length));
    }
  }
  return node;
}

// From what distance each level is shown: where the hair takes up the fraction of the screen that the
// file has for the level before.
function beginsOf(gltf, levels, fieldOfView) {
  const size = Math.max(...boundsOf(levels[0]).getSize(new THREE.Vector3()).toArray());
  const slope = 2 * Math.tan(THREE.MathUtils.degToRad(fieldOfView) / 2);
  const { extras } = gltf.parser.json.nodes[numberOf(gltf, levels[0])];
  const coverage = extras?.MSFT_screencoverage ?? levels.slice(1).map(({ error }, number) =>
    error ? Math.min(1, size / (error * SCREEN_HEIGHT)) ** 2 : 0.25 ** (number + 1));
  return levels.map((_, number) => (number ? size / (slope * Math.sqrt(coverage[number - 1])) : 0));
}

function boundsOf({ bounds: { minimum, maximum } }) {
  return new THREE.Box3(new THREE.Vector3(...minimum), new THREE.Vector3(...maximum));
}

// The same triangles once for each pass of the sidecar, in its order. Each pass has its own states, and
// back faces have their own order if the sidecar contains one.
function passesOf(node, sidecar, backIndex, uniforms) {
  return sidecar.passes.map((pass, number) => {
    const isBack = backIndex && pass.cull === 'front';
    const geometry = isBack ? reordered(node.geometry, backIndex) : node.geometry;
    const material = materialOf(pass, sidecar, uniforms);
    const mesh = node.isSkinnedMesh
      ? new THREE.SkinnedMesh(geometry, material)
      : new THREE.Mesh(geometry, material);
    if (node.isSkinnedMesh) {
      mesh.bind(node.skeleton, node.bindMatrix);
      mesh.frustumCulled = false; // it moves out of its bounds
    } else {
      node.updateMatrix();
      mesh.applyMatrix4(node.matrix); // rounded positions are scaled back by it
    }
    mesh.renderOrder = 1 + number; // after all opaque meshes, including the head
    return mesh;
  });
}

// The same vertices, which the GPU has once, in triangles of another order.
function reordered(geometry, index) {
  const made = new THREE.BufferGeometry().setIndex(index);
  Object.entries(geometry.attributes).forEach(([name, values]) => made.setAttribute(name, values));
  return made;
}

// All indices of the index buffer; null if back faces have no order of their own.
async function indicesOf({ index_buffer: buffer, levels }, addressOf, warn) {
  const last = levels[levels.length - 1];
  if (!buffer || last.buffer_back_first === undefined) return null;
  const answer = await fetch(addressOf(buffer.file)).catch(() => null);
  const bytes = answer?.ok ? await answer.arrayBuffer() : new ArrayBuffer(0);
  const size = buffer.type === 'uint16' ? 2 : 4;
  if (bytes.byteLength < (last.buffer_back_first + last.indices) * size) {
    warn(`${buffer.file}: it is missing or cut off, so back faces have the order of front faces`);
    return null;
  }
  return size === 2 ? new Uint16Array(bytes) : new Uint32Array(bytes);
}

function backIndexOf(all, { buffer_back_first: first, indices }) {
  return new THREE.BufferAttribute(all.slice(first, first + indices), 1);
}

const DEPTH = { less: THREE.LessDepth, equal: THREE.EqualDepth };
const SIDE = { none: THREE.DoubleSide, front: THREE.BackSide, back: THREE.FrontSide };

function materialOf(pass, sidecar, uniforms) {
  const blended = pass.blend !== 'off';
  return new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    lights: true,
    fog: true,
    clipping: true,
    uniforms: {
      ...THREE.UniformsUtils.clone(THREE.UniformsLib.lights),
      ...THREE.UniformsUtils.clone(THREE.UniformsLib.fog),
      ...uniforms,
      part: { value: new THREE.Vector2(0, 1) },
    },
    defines: {
      IS_PRIME: pass.color_write ? 0 : 1,
      IS_OPAQUE: blended ? 0 : 1,
      LEAST_ALPHA: leastAlpha(pass, sidecar).toFixed(6),
      NORMAL_MAP: sidecar.textures.normal ? 1 : 0,
      TANGENT_MAP: sidecar.textures.highlights_by === 'tangent' && sidecar.textures.tangent ? 1 : 0,
      VIEW_COMPENSATED_ALPHA: sidecar.textures.view_compensated_alpha ? 1 : 0,
    },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT.replace('#include <hair_shading>', SHADING),
    colorWrite: pass.color_write,
    depthWrite: pass.depth_write,
    depthFunc: DEPTH[pass.depth_test],
    side: SIDE[pass.cull],
    transparent: true, // so that only renderOrder decides, for opaque pixels too
    forceSinglePass: true,
    blending: blended ? THREE.CustomBlending : THREE.NoBlending,
    blendSrc: THREE.OneFactor, // the shader premultiplies alpha
    blendDst: THREE.OneMinusSrcAlphaFactor,
  });
}

function leastAlpha(pass, sidecar) {
  if (!pass.color_write) return sidecar.opaque_alpha;
  return pass.pixels.includes('min_alpha') ? sidecar.min_alpha : 0.0;
}

// Leaves textures out of the sidecar that cannot be loaded.
async function uniformsOf(sidecar, addressOf, warn) {
  const { model, values, fibre, tables } = sidecar.material;
  const facing = sidecar.textures.view_compensated_alpha;
  const uniforms = {
    facing_range: { value: new THREE.Vector2(facing?.mean_facing, facing?.min_facing) },
    model: { value: model === 'marschner' ? 1 : 0 },
  };
  for (const [name, value] of Object.entries(values)) {
    if (Array.isArray(value)) uniforms[name] = { value: new THREE.Vector3(...value) };
    else if (typeof value === 'number') uniforms[name] = { value };
  }
  for (const [name, value] of Object.entries(fibre ?? {})) {
    uniforms[`fibre_${name}`] = { value: new THREE.Vector4(...value) };
  }
  const loaded = (file, promise) =>
    promise.catch(() => {
      const what = isDDS(file)
        ? 'three.js cannot read it; export the cards again, with textures as PNG'
        : 'it is missing or cannot be read; copy all files of the export';
      warn(`${file}: ${what}`);
      return null;
    });
  await Promise.all([
    ...Object.entries(TEXTURES).map(async ([name, empty]) => {
      const entry = sidecar.textures[name];
      const texture = entry && (await loaded(entry.file, textureOf(entry, addressOf(entry.file), name)));
      if (!texture) delete sidecar.textures[name];
      uniforms[`${name}_texture`] = { value: texture || plain(empty) };
      uniforms[`${name}_mask`] = { value: maskOf(entry) };
    }),
    ...TABLES.filter((name) => tables && tables[name]).map(async (name) => {
      const { file } = tables[name];
      uniforms[name] = { value: (await loaded(file, tableOf(addressOf(file)))) || plain(0) };
    }),
  ]);
  for (const axis of [0, 1, 2]) uniforms[`tangent_${'xyz'[axis]}`] = { value: lanesOf(sidecar.textures.tangent, axis) };
  uniforms.base_gain = { value: sidecar.textures.base?.gain ?? 1.0 }; // 8 bits hold no more than 1
  return uniforms;
}

// Selects the channel of a single value, such as alpha in the fourth channel of another image.
function maskOf(entry) {
  const channel = 'rgba'.indexOf(entry?.channels?.[0] ?? 'r');
  return new THREE.Vector4(...[0, 1, 2, 3].map((lane) => (lane === channel ? 1 : 0)));
}

// What a component of a direction is made of, see hair_texel; one that the file has not is 0.
function lanesOf({ channels = 'rgb', inverted = '' } = {}, axis) {
  const letter = channels[axis];
  if (!letter) return new THREE.Vector4(0, 0, 0, 0.5);
  const isInverted = inverted.includes(letter);
  const lanes = new THREE.Vector4(0, 0, 0, isInverted ? 1 : 0);
  return lanes.setComponent('rgb'.indexOf(letter), isInverted ? -1 : 1);
}

function plain(value) {
  const texture = new THREE.DataTexture(new Uint8Array(4).fill(value), 1, 1);
  texture.needsUpdate = true;
  return texture;
}

function isDDS(file) {
  return /\.dds$/i.test(file);
}

async function textureOf({ file, color_space: space }, address, name) {
  const isEXR = /\.exr$/i.test(file);
  const loader = THREE.DefaultLoadingManager.getHandler(file) ?? new (isEXR ? EXRLoader : THREE.TextureLoader)();
  const texture = await loader.loadAsync(address);
  // what DDSLoader gives for a format that it does not know
  if (texture.isCompressedTexture && !texture.mipmaps?.length) throw new Error(`${file}: it has no pixels`);
  texture.flipY = isEXR; // glTF counts v from the top of the picture, whose lowest row this loader has first
  texture.colorSpace = space === 'sRGB' && !isEXR ? THREE.SRGBColorSpace : THREE.NoColorSpace;
  if (isEXR) {
    texture.minFilter = THREE.LinearMipmapLinearFilter;
    texture.generateMipmaps = true;
  }
  texture.wrapS = texture.wrapT = REPEATED.includes(name)
    ? THREE.RepeatWrapping
    : THREE.ClampToEdgeWrapping;
  return texture;
}

async function tableOf(file) {
  const table = await new EXRLoader().setDataType(THREE.HalfFloatType).loadAsync(file);
  table.minFilter = table.magFilter = THREE.LinearFilter;
  table.generateMipmaps = false;
  return table;
}

const VERTEX = /* glsl */ `
#include <common>
#include <fog_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
in vec2 uv1;
in vec4 tangent;
out vec2 card_uv;
out vec2 occlusion_and_along;
out vec3 card_point;
out vec3 card_normal;
out vec3 card_tangent;
invariant gl_Position; // so that the second pass gets exactly the depths of the first

void main() {
  card_uv = uv;
  occlusion_and_along = uv1;
  vec3 transformed = position;
  vec3 objectNormal = normal;
  vec3 objectTangent = tangent.w * cross(normal, tangent.xyz); // from root to tip
#ifdef USE_SKINNING
#include <skinbase_vertex>
  mat3 turned = mat3(bindMatrixInverse * (skinWeight.x * boneMatX + skinWeight.y * boneMatY +
                                          skinWeight.z * boneMatZ + skinWeight.w * boneMatW) *
                     bindMatrix);
  objectNormal = turned * objectNormal;
  objectTangent = turned * objectTangent;
#include <skinning_vertex>
#endif
  vec4 mvPosition = modelViewMatrix * vec4(transformed, 1.0);
  card_point = mvPosition.xyz;
  card_normal = normalMatrix * objectNormal;
  card_tangent = mat3(modelViewMatrix) * objectTangent;
  gl_Position = projectionMatrix * mvPosition;
#include <fog_vertex>
#include <logdepthbuf_vertex>
#include <clipping_planes_vertex>
}`;

const FRAGMENT = /* glsl */ `
#include <common>
#include <lights_pars_begin>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
#define gl_FragColor color // what three.js mixes fog into
#include <hair_shading>

uniform int model;
uniform vec3 base_color, tip_color, primary_color, secondary_color;
uniform float tip_tint, tint_start, tint_end, grey_fraction, shift_noise, sparkle, ambient;
uniform float primary_strength, primary_exponent, primary_shift;
uniform float secondary_strength, secondary_exponent, secondary_shift;
uniform float fake_scattering, volume_shadow, base_gain;
uniform vec2 facing_range, part;
uniform vec4 fibre_root, fibre_tip, fibre_strengths;
uniform sampler2D base_texture, alpha_texture, shift_texture, noise_texture, tangent_texture;
uniform sampler2D normal_texture;
uniform vec4 alpha_mask, shift_mask, noise_mask, tangent_x, tangent_y, tangent_z;
uniform sampler2D longitudinal, azimuthal, paths;

in vec2 card_uv;
in vec2 occlusion_and_along;
in vec3 card_point;
in vec3 card_normal;
in vec3 card_tangent;
out vec4 color;

HairMaterial material() {
  return HairMaterial(model, base_color, tip_color, tip_tint, tint_start, tint_end, grey_fraction,
                      shift_noise, sparkle, ambient, primary_color, primary_strength,
                      primary_exponent, primary_shift, secondary_color, secondary_strength,
                      secondary_exponent, secondary_shift, fibre_root, fibre_tip,
                      fibre_strengths, fake_scattering, volume_shadow);
}

HairPlace place() {
  HairPlace here;
  here.to_eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-card_point);
  vec3 normal = hair_unit(card_normal, vec3(0.0, 0.0, 1.0));
  vec3 tangent = hair_unit(card_tangent, vec3(0.0, 0.0, 1.0));
  here.normal = normal;
  here.tangent = tangent;
  here.along = occlusion_and_along.y;
  here.base = base_gain * texture(base_texture, card_uv).xyz;
  here.shift = 0.5;
  here.sparkle = dot(texture(noise_texture, card_uv), noise_mask);
#if TANGENT_MAP
  vec3 texel = hair_texel(texture(tangent_texture, card_uv).xyz, tangent_x, tangent_y, tangent_z);
  here.tangent = hair_tangent(texel, tangent, normal, shift_noise);
#else
  here.shift = dot(texture(shift_texture, card_uv), shift_mask);
#endif
#if NORMAL_MAP
  here.normal = hair_normal(texture(normal_texture, card_uv).xyz, tangent, normal);
#endif
  return here;
}

void main() {
#include <clipping_planes_fragment>
#include <logdepthbuf_fragment>
  if (!hair_level_has(gl_FragCoord.xy, part)) discard;
  float alpha = dot(texture(alpha_texture, card_uv), alpha_mask);
#if VIEW_COMPENSATED_ALPHA && !IS_PRIME
  vec3 to_eye = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(-card_point);
  vec3 across = cross(dFdx(card_point), dFdy(card_point));
  vec3 along = hair_unit(card_tangent, vec3(0.0, 0.0, 1.0));
  alpha = hair_view_compensated_alpha(alpha, across, along, to_eye, facing_range);
#endif
  if (alpha < LEAST_ALPHA) discard;
#if IS_PRIME
  color = vec4(0.0);
#else
  HairMaterial hair = material();
  HairPlace here = place();
  vec3 radiance = vec3(0.0);
#if NUM_DIR_LIGHTS > 0
  for (int i = 0; i < NUM_DIR_LIGHTS; i++) {
    radiance += directionalLights[i].color *
                hair_light(hair, longitudinal, azimuthal, paths, here, directionalLights[i].direction);
  }
#endif
#if NUM_POINT_LIGHTS > 0
  for (int i = 0; i < NUM_POINT_LIGHTS; i++) {
    vec3 away = pointLights[i].position - card_point;
    float fading = getDistanceAttenuation(length(away), pointLights[i].distance, pointLights[i].decay);
    radiance += fading * pointLights[i].color *
                hair_light(hair, longitudinal, azimuthal, paths, here, normalize(away));
  }
#endif
  float occlusion = occlusion_and_along.x;
  radiance *= hair_lit_fraction(hair, occlusion);
  radiance += hair_ambient(hair, here.along, here.base, occlusion) * ambientLightColor / HAIR_PI;
  float covered = IS_OPAQUE == 1 ? 1.0 : alpha;
  color = linearToOutputTexel(vec4(radiance, 1.0));
#include <fog_fragment>
  color = vec4(color.xyz * covered, covered);
#endif
}`;
