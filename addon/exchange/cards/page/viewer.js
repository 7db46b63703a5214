// The script of an export's web page: it shows the asset that is embedded in the page.
// tools/make_viewer.py bundles it with three.js into viewer.min.js.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { loadHairloomCards } from '../../../../docs/engines/three/hairloom_cards.js';

const FIELD_OF_VIEW = 30;
const CALM = matchMedia('(prefers-reduced-motion: reduce)').matches;
// The direction to each sun in degrees around and above the hair, relative to the first view.
const SUNS = [
  { around: 38, above: 36 },
  { around: -62, above: 12 },
  { around: 165, above: 40 },
];
// background: middle and edge; suns: color and strength of the key, the fill and the rim
const SURROUNDINGS = {
  Studio: { background: ['#3c3d42', '#17181b'], ambient: ['#ffffff', 0.7], suns: [['#fff4e6', 3.2], ['#dfe8ff', 0.9], ['#ffffff', 2.6]] },
  Daylight: { background: ['#c3d0dc', '#8c9fb2'], ambient: ['#cfe0ff', 1.3], suns: [['#fff1d6', 3.8], ['#cfe0ff', 0.9], ['#fff6e8', 1.4]], light: true },
  Dusk: { background: ['#57404a', '#1b1722'], ambient: ['#a99cff', 0.5], suns: [['#ffb070', 3.2], ['#8890ff', 0.9], ['#ff8a9c', 3.0]] },
  Paper: { background: ['#f4f3ef', '#d9d7d1'], ambient: ['#ffffff', 1.4], suns: [['#ffffff', 2.8], ['#ffffff', 1.0], ['#ffffff', 1.6]], light: true },
};

const of = (id) => document.getElementById(id);
const asset = JSON.parse(of('asset').textContent);

function say(sentence) {
  of('status').textContent = '';
  of('sentence').textContent = sentence;
  of('sentence').hidden = false;
  of('picture').hidden = of('corner').hidden = true;
  document.documentElement.dataset.state = 'failed';
}

async function show() {
  if (!document.createElement('canvas').getContext('webgl2')) throw new Error('no WebGL 2');
  const addresses = await unpacked(asset.files);
  const renderer = new THREE.WebGLRenderer({
    canvas: of('picture'),
    antialias: true,
    outputBufferType: THREE.HalfFloatType, // hair blends in linear light
  });
  renderer.toneMapping = THREE.LinearToneMapping; // as Hairloom's own pictures
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = THREE.VSMShadowMap; // soft edges without noise
  renderer.shadowMap.autoUpdate = false;
  const scene = new THREE.Scene();
  const hair = await loadHairloomCards(encodeURIComponent(asset.mesh), {
    fieldOfView: FIELD_OF_VIEW,
    addressOf: (name) => addresses.get(name),
  });
  scene.add(hair);
  const head = await headOf(addresses);
  if (head) (hair.getObjectByName('hair_root') ?? scene).attach(head); // so that it moves with the hair

  const camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 1, 2);
  const controls = new OrbitControls(camera, renderer.domElement);
  controls.enableDamping = !CALM;
  controls.autoRotateSpeed = 0.8;
  const bounds = new THREE.Box3().setFromPoints(asset.corners.map((each) => new THREE.Vector3(...each)));
  const sphere = bounds.getBoundingSphere(new THREE.Sphere());
  const reset = framing(camera, controls, sphere);
  reset();

  const player = hair.animations.length ? new THREE.AnimationMixer(hair) : null;
  player?.clipAction(hair.animations[0]).play();
  const clock = new THREE.Timer();

  let isPlaying = false;
  let isDue = true;
  const redraw = () => { isDue = renderer.shadowMap.needsUpdate = true; };
  const play = (on) => {
    isPlaying = on;
    controls.autoRotate = on && !player;
    of('play').setAttribute('aria-pressed', on);
    redraw();
  };
  of('play').textContent = player ? 'Motion' : 'Turntable';
  of('play').onclick = () => play(!isPlaying);
  of('reset').onclick = () => { reset(); redraw(); };
  controls.addEventListener('change', () => { isDue = true; });
  new ResizeObserver(() => { fit(renderer, camera); redraw(); }).observe(of('stage'));
  renderer.domElement.addEventListener('keydown', (event) => {
    if (turned(event.key, camera, controls, reset)) {
      event.preventDefault();
      redraw();
    }
  });

  levelChoices(hair, redraw);
  const turnLights = surroundingsOf(scene, sphere, redraw);
  if (head) castShadows(hair, head);
  of('lights').oninput = ({ target }) => {
    of('angle').textContent = `${target.value}°`;
    turnLights(target.valueAsNumber);
    redraw();
  };
  orderSwitch(hair, redraw);
  wireframeSwitch(hair, redraw);
  of('head-switch').hidden = !head;
  of('head').onchange = ({ target }) => { head.visible = target.checked; redraw(); };
  showMaps(addresses);
  showSizes();

  fit(renderer, camera);
  play(!CALM);
  renderer.setAnimationLoop((time) => {
    clock.update(time);
    controls.update(clock.getDelta());
    if (isPlaying && player) {
      player.update(clock.getDelta());
      redraw();
    }
    if (!isDue && !isPlaying) return;
    isDue = false;
    renderer.render(scene, camera);
    showLevel(hair);
    document.documentElement.dataset.state = 'ready';
  });
  globalThis.hairloom = { scene, hair, camera, controls, renderer, redraw };
}

// File name -> address of its content, which is in the page as base64, in part compressed.
async function unpacked(files) {
  const entries = Object.entries(files).map(async ([name, { type, data, gzip }]) => {
    let blob = new Blob([Uint8Array.from(atob(data), (sign) => sign.charCodeAt(0))], { type });
    if (gzip) {
      const stream = blob.stream().pipeThrough(new DecompressionStream('gzip'));
      blob = new Blob([await new Response(stream).blob()], { type });
    }
    return [name, URL.createObjectURL(blob)];
  });
  return new Map(await Promise.all(entries));
}

async function headOf(addresses) {
  if (!asset.head.length) return null;
  const numbers = async (name, Kind) => new Kind(await (await fetch(addresses.get(`head.${name}`))).arrayBuffer());
  const geometry = new THREE.BufferGeometry();
  for (const [attribute, name, size] of [['position', 'positions', 3], ['normal', 'normals', 3], ['uv', 'uv', 2]]) {
    if (!addresses.has(`head.${name}`)) continue;
    geometry.setAttribute(attribute, new THREE.BufferAttribute(await numbers(name, Float32Array), size));
  }
  geometry.setIndex(new THREE.BufferAttribute(await numbers('triangles', Uint32Array), 1));
  let begin = 0;
  asset.head.forEach(({ triangles }, part) => {
    geometry.addGroup(3 * begin, 3 * triangles, part);
    begin += triangles;
  });
  const pictures = new Map();
  for (const { picture } of asset.head) {
    if (picture && !pictures.has(picture)) pictures.set(picture, await pictureOf(addresses.get(picture)));
  }
  return new THREE.Mesh(geometry, asset.head.map((part) => materialOf(part, pictures.get(part.picture))));
}

async function pictureOf(address) {
  const picture = await new THREE.TextureLoader().loadAsync(address);
  picture.colorSpace = THREE.SRGBColorSpace;
  picture.wrapS = picture.wrapT = THREE.RepeatWrapping;
  picture.anisotropy = 4;
  return picture;
}

function materialOf({ color, emission, roughness, specular, alpha, transparency }, picture) {
  const boundary = Math.sqrt(Math.min(specular, 0.16)); // a boundary that reflects this amplitude has the index of refraction below
  return new THREE.MeshPhysicalMaterial({
    color: picture ? '#ffffff' : new THREE.Color(...color),
    map: picture ?? null,
    emissive: new THREE.Color(...emission),
    roughness,
    ior: (1 + boundary) / (1 - boundary),
    opacity: alpha,
    alphaHash: transparency === 'hashed',
    transparent: transparency === 'blended',
    side: THREE.DoubleSide,
  });
}

// The first view: the whole hair from the front, a little from its side and from above.
function framing(camera, controls, { center, radius }) {
  return () => {
    const narrow = Math.min(camera.aspect, 1);
    const away = (0.98 * radius) / Math.sin(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2)) / narrow;
    controls.target.copy(center);
    camera.position.setFromSphericalCoords(away, THREE.MathUtils.degToRad(84), THREE.MathUtils.degToRad(28)).add(center);
    [camera.near, camera.far] = [0.02 * radius, 60 * radius];
    [controls.minDistance, controls.maxDistance] = [0.3 * radius, 30 * radius];
    camera.updateProjectionMatrix();
    controls.update();
  };
}

function fit(renderer, camera) {
  const { clientWidth: width, clientHeight: height } = of('stage');
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  renderer.setSize(width, height, false);
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
}

const TURN = THREE.MathUtils.degToRad(6);
const TURNS = { ArrowLeft: [-TURN, 0], ArrowRight: [TURN, 0], ArrowUp: [0, -TURN], ArrowDown: [0, TURN] };
const ZOOMS = { '+': 0.9, '=': 0.9, '-': 1 / 0.9 };

// Whether a key is one that moves the camera.
function turned(key, camera, controls, reset) {
  if (key === 'Home') {
    reset();
    return true;
  }
  const place = new THREE.Spherical().setFromVector3(camera.position.clone().sub(controls.target));
  if (TURNS[key]) {
    place.theta += TURNS[key][0];
    place.phi += TURNS[key][1];
    place.makeSafe();
  } else if (ZOOMS[key]) place.radius *= ZOOMS[key];
  else return false;
  camera.position.setFromSpherical(place).add(controls.target);
  controls.update();
  return true;
}

// Radio buttons below a legend; the first one is chosen.
function choices(id, entries, chosen) {
  const row = document.createElement('div');
  row.className = 'choices';
  entries.forEach(([value, filled], number) => {
    const label = document.createElement('label');
    const input = document.createElement('input');
    const face = document.createElement('span');
    label.className = 'choice';
    Object.assign(input, { type: 'radio', name: id, value, checked: number === 0 });
    input.onchange = () => chosen(value);
    face.append(...filled);
    label.append(input, face);
    row.append(label);
  });
  of(id).append(row);
}

function small(text) {
  const element = document.createElement('small');
  element.textContent = text;
  return element;
}

const counted = (number) => number.toLocaleString('en');

function levelChoices(hair, redraw) {
  const levels = asset.levels.map(({ triangles }, number) => [`${number}`, [`${number}`, small(counted(triangles))]]);
  choices('levels', [['auto', ['Auto', small('distance')]], ...levels], (value) => {
    hair.autoUpdate = value === 'auto';
    if (!hair.autoUpdate) {
      hair.levels.forEach(({ object }, number) => { object.visible = number === Number(value); });
    }
    redraw();
  });
}

function showLevel(hair) {
  const shown = hair.levels.findIndex(({ object }) => object.visible);
  const { triangles, cards } = asset.levels[shown];
  of('status').textContent = `${counted(triangles)} triangles in ${counted(cards)} cards, level ${shown}`;
}

function surroundingsOf(scene, { center, radius }, redraw) {
  const ambient = new THREE.AmbientLight();
  const suns = SUNS.map(() => new THREE.DirectionalLight());
  suns.forEach((sun) => { sun.castShadow = true; });
  const backgrounds = new Map();
  const use = (name) => {
    const { background, ambient: [color, strength], suns: lights, light } = SURROUNDINGS[name];
    if (!backgrounds.has(name)) backgrounds.set(name, gradient(...background));
    scene.background = backgrounds.get(name);
    ambient.color.set(color);
    ambient.intensity = strength;
    lights.forEach(([sunColor, sunStrength], number) => {
      suns[number].color.set(sunColor);
      suns[number].intensity = sunStrength;
    });
    of('stage').classList.toggle('light', Boolean(light));
    redraw();
  };
  const turn = (degrees) => SUNS.forEach(({ around, above }, number) => {
    const [phi, theta] = [90 - above, around + degrees].map(THREE.MathUtils.degToRad);
    suns[number].position.setFromSphericalCoords(4 * radius, phi, theta).add(center);
  });
  suns.forEach(({ target, shadow }) => {
    target.position.copy(center);
    shadow.mapSize.set(512, 512);
    shadow.normalBias = 0.01 * radius;
    shadow.radius = 10;
    shadow.blurSamples = 20;
    Object.assign(shadow.camera, { left: -1.5 * radius, right: 1.5 * radius, bottom: -1.5 * radius, top: 1.5 * radius, near: 0.5 * radius, far: 8 * radius });
    scene.add(target);
  });
  scene.add(ambient, ...suns);
  const entries = Object.entries(SURROUNDINGS).map(([name, { background: [middle, edge] }]) => {
    const swatch = document.createElement('i');
    swatch.style.background = `radial-gradient(${middle}, ${edge})`;
    return [name, [swatch, name]];
  });
  choices('surroundings', entries, use);
  use(Object.keys(SURROUNDINGS)[0]);
  turn(0);
  return turn;
}

// Shadows of the hair on the head. Those among strands are in the shading of the cards.
function castShadows(hair, head) {
  hair.levels.forEach(({ object }) => {
    const [caster] = object.children;
    caster.castShadow = true;
    caster.customDepthMaterial = new THREE.MeshDepthMaterial({
      alphaMap: caster.material.uniforms.alpha_texture.value,
      alphaTest: 0.4,
      side: THREE.DoubleSide,
    });
  });
  head.castShadow = head.receiveShadow = true;
}

// Small, so that the GPU's filter has more steps than 8 bits.
function gradient(middle, edge) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 32;
  const pen = canvas.getContext('2d');
  pen.fillStyle = pen.createRadialGradient(16, 15, 0, 16, 16, 24);
  pen.fillStyle.addColorStop(0, middle);
  pen.fillStyle.addColorStop(1, edge);
  pen.fillRect(0, 0, 32, 32);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  return texture;
}

// The same triangles in the order in which their cards were built.
function unordered(geometry) {
  const index = geometry.index.array;
  const triangles = Array.from({ length: index.length / 3 }, (_, number) => index.subarray(3 * number, 3 * number + 3));
  triangles.sort((one, two) => Math.min(...one) - Math.min(...two));
  const plain = new THREE.BufferGeometry();
  Object.entries(geometry.attributes).forEach(([name, values]) => plain.setAttribute(name, values));
  const sorted = new index.constructor(index.length);
  triangles.forEach((corners, number) => sorted.set(corners, 3 * number));
  plain.setIndex(new THREE.BufferAttribute(sorted, 1));
  return plain;
}

// Off: as a renderer draws any mesh with alpha, in one pass and in the order in which cards were built.
function orderSwitch(hair, redraw) {
  const levels = hair.levels.map(({ object }) => ({ object, passes: [...object.children], plain: null }));
  of('order').onchange = ({ target }) => {
    levels.forEach((level) => {
      level.plain ??= plainMesh(level.object, level.passes);
      level.passes.forEach((pass) => { pass.visible = target.checked; });
      level.plain.visible = !target.checked;
    });
    redraw();
  };
}

function plainMesh(group, passes) {
  const last = passes.at(-1);
  const material = last.material.clone();
  Object.assign(material, { uniforms: last.material.uniforms, side: THREE.DoubleSide });
  const mesh = meshLike(last, unordered(last.geometry), material);
  mesh.onBeforeRender = last.onBeforeRender; // which sets the level's part of the pixels
  mesh.castShadow = passes[0].castShadow;
  mesh.customDepthMaterial = passes[0].customDepthMaterial;
  group.add(mesh);
  return mesh;
}

function meshLike(other, geometry, material) {
  const mesh = other.isSkinnedMesh ? new THREE.SkinnedMesh(geometry, material) : new THREE.Mesh(geometry, material);
  if (other.isSkinnedMesh) mesh.bind(other.skeleton, other.bindMatrix);
  mesh.frustumCulled = other.frustumCulled;
  return mesh;
}

function wireframeSwitch(hair, redraw) {
  const material = new THREE.MeshBasicMaterial({ color: '#5cc8f0', wireframe: true, transparent: true, opacity: 0.45, depthWrite: false });
  const lines = hair.levels.map(({ object }) => {
    const mesh = meshLike(object.children[0], object.children[0].geometry, material);
    mesh.renderOrder = 100;
    mesh.visible = false;
    return mesh;
  });
  of('wireframe').onchange = ({ target }) => {
    lines.forEach((mesh) => { mesh.visible = target.checked; });
    redraw();
  };
  hair.levels.forEach(({ object }, number) => object.add(lines[number]));
}

function showMaps(addresses) {
  asset.maps.forEach(({ title, file, meaning }) => {
    const button = document.createElement('button');
    const picture = document.createElement('img');
    const caption = document.createElement('span');
    button.type = 'button';
    Object.assign(picture, { src: addresses.get(file), alt: '' });
    caption.textContent = title;
    button.append(picture, caption);
    button.onclick = () => {
      of('large-name').textContent = title;
      of('large-meaning').textContent = meaning;
      of('large-map').src = picture.src;
      of('large').showModal();
    };
    of('maps').append(button);
  });
}

function showSizes() {
  of('sizes').append(...asset.sizes.flatMap(([name, value]) => {
    const [term, number] = ['dt', 'dd'].map((tag) => document.createElement(tag));
    term.textContent = name;
    number.textContent = value;
    return [term, number];
  }));
}

try {
  await show();
} catch (reason) {
  const has3d = document.createElement('canvas').getContext('webgl2');
  say(has3d
    ? `The hair cannot be shown: ${reason.message}`
    : 'This browser cannot draw in three dimensions (WebGL 2 is off), so the hair is not shown. Turn on graphics acceleration, or open the page in another browser.');
  if (has3d) console.error(reason);
}
