import type { Group, LOD, Object3D, Vector3 } from 'three';
import type { GLTFLoaderPlugin, GLTFParser } from 'three/addons/loaders/GLTFLoader.js';

export interface HairloomCardsOptions {
  /** Shows this level alone, 0 the finest; without it each is shown from the distance at which it takes over. */
  level?: number;
  /** Of the camera for which these distances are [degrees, vertical]; 50 unless given. */
  fieldOfView?: number;
  /** Of a distance, how wide the band is in which two levels are drawn; 0: levels change at once; 0.1 unless given. */
  crossFade?: number;
  /** The address of a file by its name, where files do not lie beside the GLB. */
  addressOf?: (file: string) => string;
  /** For GLTFLoader.register; what they find is in userData of the hair. */
  plugins?: ((parser: GLTFParser) => GLTFLoaderPlugin)[];
  /** Gets a sentence for each thing that is wrong; console.warn unless given. */
  warn?: (sentence: string) => void;
}

/** All levels; each takes over at its own distance from the middle of the hair. */
export class HairLevels extends LOD {
  crossFade: number;
  center: Vector3;
}

/**
 * Hair of a GLB with its sidecar and textures. Without a sidecar that fits it is the scene of the file, in its plain
 * material. Throws where the GLB itself cannot be read. In an address, signs of a name such as # and % are escaped.
 */
export function loadHairloomCards(
  url: string | URL,
  options: HairloomCardsOptions & { level: number },
): Promise<Group>;
export function loadHairloomCards(url: string | URL, options?: HairloomCardsOptions): Promise<HairLevels | Group>;

/** Takes hair out of its scene and frees what the GPU holds of it. Its copies share materials and textures with it. */
export function disposeHairloomCards(hair: Object3D): void;
