// Light field maps as a browser holds them: tables, tiles in layers of textures, S3TC blocks, corrections on edges.
// The layouts are those of docs/format.md and render/lightfield/lfm/{tile,edge_corrections}.h.
"use strict";
(() => {
  const side = 2048; // texels of a layer that every browser has

  function bytesOf(base64) {
    const text = atob(base64), bytes = new Uint8Array(text.length);
    for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i);
    return bytes;
  }
  const numbersOf = (base64, Kind) => new Kind(bytesOf(base64).buffer);

  // Maps and the map of each user, -1 for none. read: { count, indexBytes, mapOf, data }; without mapOf, user i has map i.
  function tableOf(read) {
    const bytes = bytesOf(read.data);
    if (!read.mapOf) return { bytes, count: read.count, mapAt: (user) => user };
    const mapOf = numbersOf(read.mapOf, read.indexBytes === 2 ? Uint16Array : Uint32Array), none = 2 ** (8 * read.indexBytes) - 1;
    return { bytes, count: read.count, mapAt: (user) => (mapOf[user] === none ? -1 : mapOf[user]) };
  }

  // Tiles of maps in layers of equal size, `most` maps in the layers of one term. shape: { isPatch, size, channels, isCoded };
  // size: samples along a triangle's edge, or cells along a side. A tile has two triangles, one of them turned, with three
  // maps each if these have one channel.
  function tilingOf(shape, most) {
    const whole = (texels) => (shape.isCoded ? Math.ceil(texels / 4) * 4 : texels);
    const width = whole(shape.size + (shape.isPatch ? 1 : 0)), height = whole(shape.size);
    const perTile = !shape.isPatch ? 1 : shape.channels === 1 ? 6 : 2, tiles = Math.max(1, Math.ceil(most / perTile));
    const columns = Math.floor(side / width), rows = Math.floor(side / height), layers = Math.ceil(tiles / (columns * rows));
    const share = Math.ceil(tiles / layers), across = Math.min(columns, Math.ceil(Math.sqrt(share * height / width)));
    const isTall = Math.ceil(share / across) > rows, used = isTall ? columns : across;
    return { shape, width, height, perTile, columns: used, rows: Math.ceil(share / used), layers };
  }

  // [x, y, layer, code] of sample (0, 0) of a map: code is 1 if samples go on to the right and up, -1 if to the left and
  // down; times 1, 2 or 3 for red, green or blue. All are 0 for no map.
  function placeOf(tiling, map) {
    if (map < 0) return [0, 0, 0, 0];
    const { shape, columns, rows } = tiling;
    const isSingle = shape.isPatch && shape.channels === 1, patch = isSingle ? Math.floor(map / 3) : map;
    const isTurned = shape.isPatch && patch % 2 === 1, tile = shape.isPatch ? patch >> 1 : patch;
    const within = tile % (columns * rows), channel = isSingle ? map % 3 : 0;
    return [within % columns * tiling.width + (isTurned ? shape.size : 0),
      Math.floor(within / columns) * tiling.height + (isTurned ? shape.size - 1 : 0),
      Math.floor(tile / (columns * rows)), (isTurned ? -1 : 1) * (1 + channel)];
  }

  // All layers of a table: S3TC blocks if its maps are coded, else RGBA.
  function layersOf(tiling, table) {
    const { shape } = tiling, width = tiling.columns * tiling.width, height = tiling.rows * tiling.height;
    if (shape.isCoded) {
      const blocks = new Uint8Array(width * height * tiling.layers / 2), row = tiling.width * 2, tileBytes = row * tiling.height / 4;
      for (let tile = 0; tile * tiling.perTile < table.count; ++tile) {
        const within = tile % (tiling.columns * tiling.rows), layer = Math.floor(tile / (tiling.columns * tiling.rows));
        const first = layer * width * height / 2 + Math.floor(within / tiling.columns) * tiling.height / 4 * width * 2 + within % tiling.columns * row;
        for (let y = 0; y < tiling.height / 4; ++y)
          blocks.set(table.bytes.subarray(tile * tileBytes + y * row, tile * tileBytes + (y + 1) * row), first + y * width * 2);
      }
      return blocks;
    }
    const texels = new Uint8Array(4 * width * height * tiling.layers), n = shape.size;
    let from = 0;
    for (let map = 0; map < table.count; ++map) {
      const [x, y, layer, code] = placeOf(tiling, map), step = Math.sign(code), channel = Math.abs(code) - 1;
      for (let j = 0; j < n; ++j)
        for (let i = 0; i < (shape.isPatch ? n - j : n); ++i) {
          const to = 4 * ((layer * height + y + step * j) * width + x + step * i) + channel;
          for (let c = 0; c < shape.channels; ++c) texels[to + c] = table.bytes[from++];
        }
    }
    return texels;
  }

  // RGBA of DXT1 blocks, each number rounded once [EXT_texture_compression_s3tc].
  function decodedBlocks(blocks, width, height) {
    const texels = new Uint8Array(4 * width * height), colors = new Uint8Array(16).fill(255);
    let block = 0;
    for (let y = 0; y < height; y += 4)
      for (let x = 0; x < width; x += 4, block += 8) {
        const first = blocks[block] | blocks[block + 1] << 8, second = blocks[block + 2] | blocks[block + 3] << 8;
        for (let c = 0; c < 3; ++c) {
          const most = c === 1 ? 63 : 31, shift = [11, 5, 0][c], a = first >> shift & most, b = second >> shift & most;
          colors[c] = Math.round(a * 255 / most);
          colors[4 + c] = Math.round(b * 255 / most);
          colors[8 + c] = Math.round(first > second ? (2 * a + b) * 255 / (3 * most) : (a + b) * 255 / (2 * most));
          colors[12 + c] = first > second ? Math.round((a + 2 * b) * 255 / (3 * most)) : 0;
        }
        for (let j = 0; j < 4; ++j)
          for (let i = 0; i < 4; ++i) {
            const code = 4 * (blocks[block + 4 + j] >> 2 * i & 3), to = 4 * ((y + j) * width + x + i);
            for (let c = 0; c < 4; ++c) texels[to + c] = colors[code + c];
          }
      }
    return texels;
  }

  // ---- Corrections on the edges of triangles.

  // Step `step` from a corner along one of its sides, as sample (i, j) of a triangle; of a map that starts at `first`.
  function onSide(n, corner, sideOfCorner, step, first) {
    const steps = [0, 0, 0];
    steps[corner] = n - 1 - step;
    steps[(corner + 1 + sideOfCorner) % 3] = step;
    return [steps[(first + 1) % 3], steps[(first + 2) % 3]];
  }

  // Numbers of the directed edges from each corner along its two sides: 6 triangle + 2 corner + side.
  function directedEdges(triangles, vertices) {
    const numbers = new Map(), edgeOf = new Uint32Array(2 * triangles.length);
    for (let t = 0; t < triangles.length; t += 3)
      for (let corner = 0; corner < 3; ++corner)
        for (let s = 0; s < 2; ++s) {
          const key = triangles[t + corner] * vertices + triangles[t + (corner + 1 + s) % 3];
          if (!numbers.has(key)) numbers.set(key, numbers.size);
          edgeOf[2 * t + 2 * corner + s] = numbers.get(key);
        }
    return { triangles, vertices, edgeOf, count: numbers.size };
  }

  // Corrections to the mean of the values of all triangles at each sample of an edge, in steps of a byte: number
  // ((3 triangle + corner) n + step) 2 + side. codeAt(triangle, corner, side, step) is the code of a byte. `meet`: the values
  // at a vertex are one for all edges that end there; else for those that begin there.
  function corrections(edges, n, meet, codeAt) {
    const { triangles, vertices, edgeOf, count } = edges, mostSteps = 127;
    const slots = count * n + vertices, sums = new Int32Array(slots), counts = new Int32Array(slots);
    const least = new Int16Array(slots).fill(255), greatest = new Int16Array(slots).fill(-255);
    const codes = new Int16Array(2 * triangles.length * n), slotOf = new Uint32Array(codes.length);
    let at = 0;
    for (let t = 0; t < triangles.length; t += 3)
      for (let corner = 0; corner < 3; ++corner)
        for (let step = 0; step < n; ++step)
          for (let s = 0; s < 2; ++s, ++at) {
            const slot = step === 0 ? count * n + triangles[t + corner]
              : meet && step === n - 1 ? count * n + triangles[t + (corner + 1 + s) % 3] : edgeOf[2 * t + 2 * corner + s] * n + step;
            const code = codeAt(t / 3, corner, s, step);
            codes[at] = code;
            slotOf[at] = slot;
            sums[slot] += code;
            ++counts[slot];
            if (code < least[slot]) least[slot] = code;
            if (code > greatest[slot]) greatest[slot] = code;
          }
    const found = new Int8Array(codes.length);
    for (let i = 0; i < found.length; ++i) {
      const slot = slotOf[i], mean = sums[slot] / counts[slot], rounded = Math.sign(mean) * Math.round(Math.abs(mean));
      const common = Math.max(Math.min(rounded, least[slot] + mostSteps), greatest[slot] - mostSteps);
      found[i] = Math.max(-mostSteps, Math.min(mostSteps, common - codes[i]));
    }
    return found;
  }

  // Rows of n texels in layers; texel i of row r is texel r n + i of all.
  function rowsOf(n, rows) {
    const perLine = Math.floor(side / n), lines = Math.max(1, Math.ceil(rows / perLine)), height = Math.min(side, lines);
    return { perLine, width: perLine * n, height, layers: Math.ceil(lines / height) };
  }

  surflect.maps = { side, bytesOf, numbersOf, tableOf, tilingOf, placeOf, layersOf, decodedBlocks, onSide, directedEdges, corrections, rowsOf };
})();
