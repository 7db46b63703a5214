// Draws hair cards exported by Hairloom in three.js (r160 or later).
//
//     const hair = await loadHairloomCards('hair.glb');
//     scene.add(hair);
//
// Reads NAME.glb, NAME.hairloom.json and the textures next to them. Uses the lights of the scene:
// ambient light, suns (DirectionalLight) and lamps (PointLight). Shadows are left to you.
// Joints that were exported move the hair: new AnimationMixer(hair).clipAction(hair.animations[0]).
import * as THREE from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const SHADING = new URL('../hair_shading.gdshaderinc', import.meta.url);
// name -> value used if the sidecar has no such texture
const TEXTURES = { base: 255, alpha: 255, shift: 128, noise: 255, tangent: 128, normal: 128 };
const TABLES = ['longitudinal', 'azimuthal', 'paths'];
const REPEATED = ['shift', 'noise'];

// of a distance: nothing flickers where a level takes over
const HYSTERESIS = 0.05;

// Options: level (0 the finest; without it a THREE.LOD shows each from the distance at which it takes
// over), fieldOfView (of the camera for which these distances are, in degrees), shading (address of
// hair_shading.gdshaderinc), addressOf (file name -> address, for files that lie elsewhere).
export async function loadHairloomCards(
  url,
  { level, fieldOfView = 50, shading = SHADING, addressOf = addressesBeside(url) } = {},
) {
  const name = url.toString().split('/').pop();
  const [sidecar, formulas, gltf] = await Promise.all([
    fetch(addressOf(name.replace(/\.glb$/, '.hairloom.json'))).then((file) => file.json()),
    fetch(shading).then((file) => file.text()),
    new GLTFLoader().loadAsync(addressOf(name)),
  ]);
  const uniforms = await uniformsOf(sidecar, addressOf);
  const groupOf = async (each) => {
    // Coarser levels are no part of the scene (MSFT_lod), so the node is asked for by its number.
    const node = await gltf.parser.getDependency('node', numberOf(gltf, each));
    const backIndex = await backIndexOf(sidecar, each, addressOf);
    const group = new THREE.Group();
    group.add(...passesOf(node, sidecar, backIndex, formulas, uniforms));
    return group;
  };
  const hair = level === undefined ? new THREE.LOD() : await groupOf(sidecar.levels[level]);
  if (level === undefined) {
    const groups = await Promise.all(sidecar.levels.map(groupOf));
    const begins = beginsOf(gltf, sidecar, fieldOfView);
    groups.forEach((group, number) => hair.addLevel(group, begins[number], HYSTERESIS));
  }
  if (sidecar.motion?.kind === 'joints') {
    hair.add(gltf.scene.getObjectByName('hair_root')); // all levels are bound to its joints
    hair.animations = gltf.animations;
  }
  return hair;
}

function addressesBeside(url) {
  const address = new URL(url, document.baseURI);
  return (name) => new URL(name, address).href;
}

function numberOf(gltf, { node }) {
  return gltf.parser.json.nodes.findIndex(({ name }) => name === node);
}

// From what distance each level is shown: where the hair takes up the fraction of the screen that the
// file has for the level before.
function beginsOf(gltf, { levels }, fieldOfView) {
  const { minimum, maximum } = levels[0].bounds;
  const size = Math.max(...maximum.map((high, axis) => high - minimum[axis]));
  const slope = 2 * Math.tan(THREE.MathUtils.degToRad(fieldOfView) / 2);
  const { extras } = gltf.parser.json.nodes[numberOf(gltf, levels[0])];
  const coverage = extras?.MSFT_screencoverage ?? [];
  return levels.map((_, number) => (number ? size / (slope * Math.sqrt(coverage[number - 1])) : 0));
}

// The same triangles once for each pass of the sidecar, in its order. Each pass has its own states, and
// back faces have their own order if the sidecar contains one.
function passesOf(node, sidecar, backIndex, formulas, uniforms) {
  return sidecar.passes.map((pass, number) => {
    const isBack = backIndex && pass.cull === 'front';
    const geometry = isBack ? node.geometry.clone().setIndex(backIndex) : node.geometry;
    const material = materialOf(pass, sidecar, formulas, uniforms);
    const mesh = node.isSkinnedMesh
      ? new THREE.SkinnedMesh(geometry, material)
      : new THREE.Mesh(geometry, material);
    if (node.isSkinnedMesh) {
      mesh.bind(node.skeleton, node.bindMatrix);
      mesh.frustumCulled = false; // it moves out of its bounds
    }
    mesh.renderOrder = 1 + number; // after all opaque meshes, including the head
    return mesh;
  });
}

async function backIndexOf({ index_buffer: buffer }, level, addressOf) {
  if (!buffer || level.buffer_back_first === undefined) return null;
  const bytes = await (await fetch(addressOf(buffer.file))).arrayBuffer();
  const isShort = buffer.type === 'uint16';
  const all = isShort ? new Uint16Array(bytes) : new Uint32Array(bytes);
  const indices = all.slice(level.buffer_back_first, level.buffer_back_first + level.indices);
  return isShort
    ? new THREE.Uint16BufferAttribute(indices, 1)
    : new THREE.Uint32BufferAttribute(indices, 1);
}

const DEPTH = { less: THREE.LessDepth, equal: THREE.EqualDepth };
const SIDE = { none: THREE.DoubleSide, front: THREE.BackSide, back: THREE.FrontSide };

function materialOf(pass, sidecar, formulas, uniforms) {
  const blended = pass.blend !== 'off';
  return new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    lights: true,
    uniforms: { ...THREE.UniformsUtils.clone(THREE.UniformsLib.lights), ...uniforms },
    defines: {
      IS_PRIME: pass.color_write ? 0 : 1,
      IS_OPAQUE: blended ? 0 : 1,
      LEAST_ALPHA: leastAlpha(pass, sidecar).toFixed(6),
      NORMAL_MAP: sidecar.textures.normal ? 1 : 0,
      TANGENT_MAP: sidecar.textures.highlights_by === 'tangent' ? 1 : 0,
      VIEW_COMPENSATED_ALPHA: sidecar.textures.view_compensated_alpha ? 1 : 0,
    },
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT.replace('#include <hair_shading>', formulas),
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

async function uniformsOf(sidecar, addressOf) {
  const { model, values, fibre, tables } = sidecar.material;
  const facing = sidecar.textures.view_compensated_alpha;
  const uniforms = {
    facing_range: { value: new THREE.Vector2(facing?.mean_facing, facing?.min_facing) },
    model: { value: model === 'marschner' ? 1 : 0 },
    base_gain: { value: sidecar.textures.base?.gain ?? 1.0 }, // 8 bits hold no more than 1
  };
  for (const [name, value] of Object.entries(values)) {
    if (Array.isArray(value)) uniforms[name] = { value: new THREE.Vector3(...value) };
    else if (typeof value === 'number') uniforms[name] = { value };
  }
  for (const [name, value] of Object.entries(fibre ?? {})) {
    uniforms[`fibre_${name}`] = { value: new THREE.Vector4(...value) };
  }
  await Promise.all([
    ...Object.entries(TEXTURES).map(async ([name, empty]) => {
      const entry = sidecar.textures[name];
      uniforms[`${name}_texture`] = {
        value: entry ? await textureOf(addressOf(entry.file), name) : plain(empty),
      };
      uniforms[`${name}_mask`] = { value: maskOf(entry) };
    }),
    ...TABLES.filter((name) => tables && tables[name]).map(async (name) => {
      uniforms[name] = { value: await tableOf(addressOf(tables[name].file)) };
    }),
  ]);
  return uniforms;
}

// Selects the channel of a single value, such as alpha in the fourth channel of another image.
function maskOf(entry) {
  const channel = 'rgba'.indexOf(entry?.channels?.[0] ?? 'r');
  return new THREE.Vector4(...[0, 1, 2, 3].map((lane) => (lane === channel ? 1 : 0)));
}

function plain(value) {
  const texture = new THREE.DataTexture(new Uint8Array(4).fill(value), 1, 1);
  texture.needsUpdate = true;
  return texture;
}

async function textureOf(file, name) {
  const texture = await new THREE.TextureLoader().loadAsync(file);
  texture.flipY = false; // glTF counts v from the top of the picture
  texture.colorSpace = name === 'base' ? THREE.SRGBColorSpace : THREE.NoColorSpace;
  texture.wrapS = texture.wrapT = REPEATED.includes(name)
    ? THREE.RepeatWrapping
    : THREE.ClampToEdgeWrapping;
  return texture;
}

async function tableOf(file) {
  const table = await new EXRLoader().setDataType(THREE.FloatType).loadAsync(file);
  table.minFilter = table.magFilter = THREE.LinearFilter;
  table.generateMipmaps = false;
  return table;
}

const VERTEX = /* glsl */ `
#include <skinning_pars_vertex>
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
  vec3 objectTangent = cross(normal, tangent.xyz); // from root to tip
#ifdef USE_SKINNING
#include <skinbase_vertex>
  mat3 turned = mat3(bindMatrixInverse * (skinWeight.x * boneMatX + skinWeight.y * boneMatY +
                                          skinWeight.z * boneMatZ + skinWeight.w * boneMatW) *
                     bindMatrix);
  objectNormal = turned * objectNormal;
  objectTangent = turned * objectTangent;
#include <skinning_vertex>
#endif
  vec4 place = modelViewMatrix * vec4(transformed, 1.0);
  card_point = place.xyz;
  card_normal = normalMatrix * objectNormal;
  card_tangent = mat3(modelViewMatrix) * objectTangent;
  gl_Position = projectionMatrix * place;
}`;

const FRAGMENT = /* glsl */ `
#include <common>
#include <lights_pars_begin>
#include <hair_shading>

uniform int model;
uniform vec3 base_color, tip_color, primary_color, secondary_color;
uniform float tip_tint, tint_start, tint_end, grey_fraction, shift_noise, sparkle, ambient;
uniform float primary_strength, primary_exponent, primary_shift;
uniform float secondary_strength, secondary_exponent, secondary_shift;
uniform float fake_scattering, volume_shadow, base_gain;
uniform vec2 facing_range;
uniform vec4 fibre_root, fibre_tip, fibre_strengths;
uniform sampler2D base_texture, alpha_texture, shift_texture, noise_texture, tangent_texture;
uniform sampler2D normal_texture;
uniform vec4 alpha_mask, shift_mask, noise_mask;
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
  here.tangent = hair_tangent(texture(tangent_texture, card_uv).xyz, tangent, normal, shift_noise);
#else
  here.shift = dot(texture(shift_texture, card_uv), shift_mask);
#endif
#if NORMAL_MAP
  here.normal = hair_normal(texture(normal_texture, card_uv).xyz, tangent, normal);
#endif
  return here;
}

void main() {
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
  vec3 radiance = hair_color(hair, here.along, here.base) * ambient * ambientLightColor / HAIR_PI;
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
  radiance *= occlusion_and_along.x;
  float covered = IS_OPAQUE == 1 ? 1.0 : alpha;
  color = linearToOutputTexel(vec4(radiance, 1.0));
  color = vec4(color.xyz * covered, covered);
#endif
}`;
