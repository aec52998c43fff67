// Tiles of planes: scripts that are loaded when they are seen, and textures made of them.
"use strict";
(() => {
  const atOnce = 6, budget = 256e6; // bytes of textures

  class Tiles {
    constructor(gl, page, changed) {
      Object.assign(this, { gl, page, changed, loaded: new Map(), waiting: new Map(), wanted: [], seen: new Set(),
        turn: 0, failed: new Set(), again: new Set(), bytes: 0 });
      surflect.tile = (name, planes) => this.waiting.get(name)?.(planes);
    }

    // Size of a level in pixels.
    static size(page, level) {
      let { width, height } = page;
      for (let n = 0; n < level; ++n) { width = Math.ceil(width / 2); height = Math.ceil(height / 2); }
      return { width, height };
    }

    // The textures of a tile, if it is loaded.
    get(name) {
      const tile = this.loaded.get(name);
      if (tile) tile.used = ++this.turn;
      return tile;
    }

    // Loads these tiles, the first ones first; forgets earlier wishes.
    want(names) {
      this.seen = new Set(names);
      this.wanted = names.filter((name) => !this.loaded.has(name) && !this.waiting.has(name) && !this.failed.has(name));
      this.next();
    }

    get busy() { return this.waiting.size + this.wanted.length > 0; }

    next() {
      while (this.waiting.size < atOnce && this.wanted.length) this.load(this.wanted.shift());
    }

    load(name) {
      const script = document.createElement("script");
      const done = () => { this.waiting.delete(name); script.remove(); this.next(); this.changed(); };
      // A tile is asked for twice: networks fail for moments. The second time, its wish comes from the next drawing.
      const lost = (problem) => {
        if (this.again.has(name)) {
          this.failed.add(name);
          surflect.fail(`A piece of the picture is missing: tiles/${name}.js ${problem}`);
        }
        this.again.add(name);
        done();
      };
      let called = false;
      this.waiting.set(name, async (planes) => {
        called = true;
        try {
          const images = await Promise.all(planes.map(async (text) => {
            const image = new Image();
            image.src = "data:image/jpeg;base64," + text;
            await image.decode();
            return image;
          }));
          const [{ width, height }] = images, bytes = width * height * images.length;
          this.loaded.set(name, { textures: images.map((image) => this.texture(image)), width, height, bytes, used: ++this.turn });
          this.bytes += bytes;
          this.forget();
          done();
        } catch (error) { lost(`cannot be decoded (${error.message})`); }
      });
      script.dataset.part = name;
      script.onerror = () => lost("cannot be loaded");
      script.onload = () => { if (!called) lost("is damaged"); };
      script.src = `tiles/${name}.js`;
      document.head.append(script);
    }

    texture(image) {
      const { gl } = this, texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, gl.RED, gl.UNSIGNED_BYTE, image);
      for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
      return texture;
    }

    // Frees the tiles that were drawn longest ago, never those that are seen.
    forget() {
      const free = [...this.loaded].filter(([name]) => !this.seen.has(name)).sort((a, b) => a[1].used - b[1].used);
      for (const [name, tile] of free) {
        if (this.bytes <= budget) return;
        tile.textures.forEach((texture) => this.gl.deleteTexture(texture));
        this.loaded.delete(name);
        this.bytes -= tile.bytes;
      }
    }
  }

  surflect.Tiles = Tiles;
})();
