// Moves the springs of a GLB as a browser would, with three.js and three-vrm: arguments: GLB, a JSON file
// with the head's matrices (column by column) and the length of a step. Prints the places of all joints.
import { readFileSync } from 'node:fs';
import { pathToFileURL } from 'node:url';

const [modules, glb, poses] = process.argv.slice(2);
const load = async (file) => import(pathToFileURL(`${modules}/node_modules/${file}`));
globalThis.self = globalThis;
const THREE = await load('three/build/three.module.js');
const { GLTFLoader } = await load('three/examples/jsm/loaders/GLTFLoader.js');
const { VRMSpringBoneLoaderPlugin } = await load(
  '@pixiv/three-vrm-springbone/lib/three-vrm-springbone.module.js',
);

// without materials and pictures, which node cannot load
const data = readFileSync(glb);
const length = data.readUInt32LE(12);
const json = JSON.parse(data.subarray(20, 20 + length));
for (const key of ['materials', 'textures', 'images', 'samplers']) delete json[key];
for (const mesh of json.meshes) for (const primitive of mesh.primitives) delete primitive.material;
json.extensionsUsed = ['VRMC_springBone'];
const text = Buffer.from(JSON.stringify(json).padEnd(length));
const whole = Buffer.concat([data.subarray(0, 20), text, data.subarray(20 + length)]);

const loader = new GLTFLoader();
loader.register((parser) => new VRMSpringBoneLoaderPlugin(parser));
const gltf = await loader.parseAsync(Uint8Array.from(whole).buffer, '');
const { vrmSpringBoneManager: manager } = gltf.userData;
const head = new THREE.Group();
head.matrixAutoUpdate = false;
head.add(gltf.scene);
const { step, matrices } = JSON.parse(readFileSync(poses));
const names = json.skins[0].joints.map((number) => json.nodes[number].name);
const joints = names.map((name) => gltf.scene.getObjectByName(name));
head.matrix.fromArray(matrices[0]);
head.updateMatrixWorld(true);
manager.setInitState();
const point = new THREE.Vector3();
const frames = matrices.map((matrix) => {
  head.matrix.fromArray(matrix);
  head.updateMatrixWorld(true);
  manager.update(step);
  head.updateMatrixWorld(true);
  return joints.map((joint) => joint.getWorldPosition(point).toArray());
});
console.log(JSON.stringify({ names, frames, springs: manager.joints.size }));
