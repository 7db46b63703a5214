// Replaces three.js's loader of EXR files in a page, whose tables are plain half floats.
import { DataTexture, HalfFloatType, RGBAFormat } from 'three';

export class EXRLoader {
  setDataType() {
    return this;
  }

  async loadAsync(address) {
    const values = new Uint16Array(await (await fetch(address)).arrayBuffer());
    const side = Math.sqrt(values.length / 4);
    const table = new DataTexture(values, side, side, RGBAFormat, HalfFloatType);
    table.needsUpdate = true;
    return table;
  }
}
