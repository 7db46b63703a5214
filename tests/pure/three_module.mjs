// Tests the module for three.js without drawing. Prints as JSON: whether each of two levels has the pixels of the
// camera that draws it, although another one came between, and the files that are requested for addresses.
import * as THREE from 'three';
import { HairLevels, loadHairloomCards } from './hairloom_cards.js';

function levelOf(...meshes) {
  return new THREE.Group().add(...meshes);
}

function cameraAt(distance) {
  const camera = new THREE.PerspectiveCamera();
  camera.position.z = distance;
  camera.updateMatrixWorld();
  return camera;
}

const meshes = [0, 1].map(() => new THREE.Mesh(
  new THREE.BufferGeometry(),
  new THREE.ShaderMaterial({ uniforms: { part: { value: new THREE.Vector2() } } }),
));
const hair = new HairLevels();
meshes.forEach((mesh, number) => hair.addLevel(levelOf(mesh), 5 * number));
const [near, mirror] = [cameraAt(2), cameraAt(9)];
const headset = new THREE.ArrayCamera([cameraAt(2)]);
headset.position.z = 2;
headset.updateMatrixWorld();
// levels are chosen for the whole picture, then a mirror in it draws all again
[near, headset, mirror].forEach((camera) => hair.update(camera));
const partOf = (mesh, camera) => {
  mesh.onBeforeRender(null, null, camera, mesh.geometry, mesh.material);
  return mesh.material.uniforms.part.value.toArray();
};
const parts = {
  near: partOf(meshes[0], near),
  eye: partOf(meshes[0], headset.cameras[0]),
  mirror: partOf(meshes[1], mirror),
};

const addresses = JSON.parse(process.argv[2]);
const asked = await Promise.all(addresses.map(async (address) => {
  const files = [];
  const addressOf = (file) => {
    files.push(file);
    return 'data:,';
  };
  await loadHairloomCards(new URL(address, 'https://a.b/'), { addressOf, warn: () => {} }).catch(() => {});
  return files;
}));
console.log(JSON.stringify({ parts, asked }));
