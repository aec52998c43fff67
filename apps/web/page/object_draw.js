// Draws light field maps by WebGL 2.
//
// [Chen 2002] Chen, Bouguet, Chu, Grzeszczuk: Light Field Mapping: Efficient Representation and Hardware Rendering of
// Surface Light Fields.
//
//   root(p, d) = mean(p) + sum over terms k, over corners v of p's triangle, of s_vk hat_v(p) g_vk(p) h_vk(d)   [Eqs. 3, 6]
//
// The symbols are those of render/lightfield/lfm/maps.h. Radiance is the square of the root. Each term is drawn as soon as
// its script is there.
"use strict";
(() => {
  const { maps, picture } = surflect;
  const none = [0, 0, 0, 0], mostSamples = 2 ** 24; // of a picture: 200 MB

  const vertexShader = `#version 300 es
    layout(location = 0) in vec3 position;
    layout(location = 1) in vec3 x0; // frames of the three corners of the vertex's triangle
    layout(location = 2) in vec3 x1;
    layout(location = 3) in vec3 x2;
    layout(location = 4) in vec3 y0;
    layout(location = 5) in vec3 y1;
    layout(location = 6) in vec3 y2;
    uniform mat4 clipFromObject;
    uniform vec3 eye;
    out vec2 barycentrics; // of corners 1 and 2
    out vec3 towards0, towards1, towards2; // to the viewer, in the frames of the corners
    flat out int triangle;
    vec3 inFrame(vec3 x, vec3 y, vec3 d) { return vec3(dot(x, d), dot(y, d), dot(cross(x, y), d)); }
    void main() {
      int corner = gl_VertexID % 3;
      triangle = gl_VertexID / 3;
      barycentrics = vec2(corner == 1, corner == 2);
      vec3 d = eye - position;
      towards0 = inFrame(x0, y0, d);
      towards1 = inFrame(x1, y1, d);
      towards2 = inFrame(x2, y2, d);
      gl_Position = clipFromObject * vec4(position, 1.0);
    }`;

  // page: what data.js holds; drawn: layouts of the textures.
  const fragmentShader = (page, drawn) => `#version 300 es
    precision highp float;
    precision highp int;
    precision highp sampler2D;
    precision highp sampler2DArray;
    uniform sampler2DArray surfaceMaps, viewMaps, meanMaps, surfaceEdges, meanEdges;
    uniform sampler2D places;
    uniform vec2 surfaceValue, viewValue; // value = max(x texel + y, -1)
    uniform float rootScale;
    uniform int terms; // that are there
    in vec2 barycentrics;
    in vec3 towards0, towards1, towards2;
    flat in int triangle;
    out vec4 color;
    const int n = ${page.samples}, last = n - 1, triangles = ${drawn.triangles}, placesOfTerm = ${drawn.placesOfTerm};
    const float meanWhite = ${Number(page.meanWhite).toExponential()}, cells = ${page.viewSize}.0;

    vec4 placeAt(int i) { return texelFetch(places, ivec2(i % ${maps.side}, i / ${maps.side}), 0); }

    // Linear interpolation between three neighbouring samples of a triangle.
    struct Blend { ivec2 a, b, c; vec3 weights; };
    Blend blendAt(vec2 place) {
      float u = clamp(place.x, 0.0, 1.0) * float(last), v = clamp(place.y * float(last), 0.0, float(last) - u);
      int i = min(int(u), last - 1), j = min(int(v), last - 1 - i);
      float x = u - float(i), y = v - float(j);
      if (x + y <= 1.0 || i + j == last - 1) return Blend(ivec2(i, j), ivec2(i + 1, j), ivec2(i, j + 1), vec3(1.0 - x - y, x, y));
      return Blend(ivec2(i + 1, j + 1), ivec2(i, j + 1), ivec2(i + 1, j), vec3(x + y - 1.0, 1.0 - x, 1.0 - y));
    }
    // A sample of a triangle whose corners start at another one.
    ivec2 turned(ivec2 s, int first) {
      int rest = last - s.x - s.y;
      return first == 0 ? s : first == 1 ? ivec2(s.y, rest) : ivec2(rest, s.x);
    }
    vec3 sampleAt(sampler2DArray map, vec4 place, ivec2 s, vec2 value) {
      return max(value.x * texelFetch(map, ivec3(place.xyz) + ivec3((place.w > 0.0 ? 1 : -1) * s, 0), 0).rgb + value.y, -1.0);
    }
    vec3 patchAt(sampler2DArray map, vec4 place, Blend blend, vec2 value) {
      if (place.w == 0.0) return vec3(0);
      return blend.weights.x * sampleAt(map, place, blend.a, value) + blend.weights.y * sampleAt(map, place, blend.b, value)
        + blend.weights.z * sampleAt(map, place, blend.c, value);
    }
    // Surface maps g of the three corners, of the term whose places start at i.
    ${page.packed ? "vec3 surfaceAt(int i, Blend blend) { return patchAt(surfaceMaps, placeAt(i), blend, surfaceValue); }" : `
    float cornerAt(vec4 place, Blend blend, int corner) {
      vec3 values = patchAt(surfaceMaps, place, Blend(turned(blend.a, corner), turned(blend.b, corner), turned(blend.c, corner), blend.weights), surfaceValue);
      float channel = abs(place.w);
      return channel < 1.5 ? values.r : channel < 2.5 ? values.g : values.b;
    }
    vec3 surfaceAt(int i, Blend blend) {
      return vec3(cornerAt(placeAt(i), blend, 0), cornerAt(placeAt(i + 1), blend, 1), cornerAt(placeAt(i + 2), blend, 2));
    }`}

    // Corrections on edges (render/lightfield/lfm/edge_corrections.h): rows of n texels, read at a distance 0..1 along a row.
    vec4 rowAt(sampler2DArray edges, int perLine, int row, float distance) {
      ivec3 size = textureSize(edges, 0);
      int line = row / perLine;
      vec2 at = vec2(float(row % perLine * n) + clamp(distance, 0.0, 1.0) * float(last) + 0.5, float(line % size.y) + 0.5);
      return texture(edges, vec3(at / vec2(size.xy), float(line / size.y)));
    }
    vec3 fade(vec3 hats) { return max(1.0 - hats * float(last) / ${page.fadeSteps.toFixed(1)}, 0.0); }
    float surfaceCorrection(vec3 hats, vec3 fades, int term, int corner) {
      int next = (corner + 1) % 3, before = (corner + 2) % 3;
      float rest = hats[next] + hats[before];
      vec2 weights = (rest > 0.0 ? vec2(hats[next], hats[before]) / rest : vec2(0.5)) * vec2(fades[before], fades[next]);
      if (weights == vec2(0)) return 0.0;
      int row = term * ${drawn.rowsOfTerm} + 3 * triangle + corner;
      return ${page.isSigned ? "1.0" : "127.0 / 255.0"} * dot(weights, rowAt(surfaceEdges, ${drawn.edges.perLine}, row, 1.0 - hats[corner]).rg);
    }
    vec3 meanCorrection(vec3 hats, vec3 fades) {
      vec3 sum = vec3(0);
      float weights = 0.0;
      for (int i = 0; i < 3; ++i) {
        int next = (i + 1) % 3;
        if (hats[i] >= 1.0) return 127.0 / 255.0 * rowAt(meanEdges, ${drawn.edges.perLine}, 3 * triangle + i, 0.0).rgb;
        float weight = hats[i] * hats[next], faded = weight * fades[(i + 2) % 3];
        weights += weight;
        if (faded > 0.0) sum += faded * rowAt(meanEdges, ${drawn.edges.perLine}, 3 * triangle + i, hats[next] / (hats[i] + hats[next])).rgb;
      }
      return weights > 0.0 ? 127.0 / 255.0 / weights * sum : vec3(0);
    }

    // Place in the view map around a direction in the frame of a vertex, in texels: constant beyond the outermost cells' centres. [Eq. 7]
    vec2 cellAt(vec3 d) {
      vec2 xy = d.xy / max(d.z < 0.0 ? length(d.xy) : length(d), 1e-30);
      return clamp((xy + 1.0) * (0.5 * cells), 0.5, cells - 0.5);
    }
    vec3 viewAt(vec4 place, vec2 cell) {
      if (place.w == 0.0) return vec3(0);
      vec2 size = vec2(textureSize(viewMaps, 0).xy);
      return place.w * max(viewValue.x * textureLod(viewMaps, vec3((place.xy + cell) / size, place.z), 0.0).rgb + viewValue.y, -1.0);
    }

    void main() {
      Blend blend = blendAt(barycentrics);
      vec3 hats = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics), inside = max(hats, 0.0), fades = fade(inside);
      vec2 view0 = cellAt(towards0), view1 = cellAt(towards1), view2 = cellAt(towards2);
      vec3 sum = vec3(0);
      ${page.mean ? `sum = meanWhite * (patchAt(meanMaps, placeAt(triangle), blend, vec2(1, 0))${drawn.meanEdges ? " + meanCorrection(inside, fades)" : ""});` : ""}
      for (int k = 0; k < terms; ++k) {
        int i = triangles + (k * triangles + triangle) * placesOfTerm;
        vec3 surface = surfaceAt(i, blend);
        ${drawn.surfaceEdges ? "for (int corner = 0; corner < 3; ++corner) surface[corner] += surfaceCorrection(inside, fades, k, corner);" : ""}
        surface *= hats;
        i += placesOfTerm - 3;
        sum += surface.x * viewAt(placeAt(i), view0) + surface.y * viewAt(placeAt(i + 1), view1) + surface.z * viewAt(placeAt(i + 2), view2);
      }
      color = vec4(rootScale * max(sum, 0.0), 1);
    }`;

  const wholePicture = `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }`;
  // Means of squares over the samples of a pixel, over the background, as screens show it.
  const resolveShader = `#version 300 es
    precision highp float;
    uniform sampler2D roots;
    uniform float perPixel; // samples along each side
    uniform ivec2 size; // of the part of the texture that is drawn
    uniform vec3 background; // linear
    out vec4 color;
    ${picture.srgb}
    void main() {
      ivec2 first = ivec2(floor(gl_FragCoord.xy) * perPixel), most = size - 1;
      int side = max(1, int(perPixel));
      vec4 sum = vec4(0);
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
          vec4 root = texelFetch(roots, min(first + ivec2(x, y), most), 0);
          sum += vec4(root.rgb * root.rgb, root.a);
        }
      sum /= float(side * side);
      color = vec4(srgb(min(sum.rgb, sum.a) + (1.0 - sum.a) * background), 1);
    }`;

  class ObjectDrawing {
    constructor(gl, page) {
      Object.assign(this, { gl, page, terms: 0 });
      this.s3tc = gl.getExtension("WEBGL_compressed_texture_s3tc");
      this.isHalf = Boolean(gl.getExtension("EXT_color_buffer_float") ?? gl.getExtension("EXT_color_buffer_half_float"));
      const Index = page.triangleBytes === 2 ? Uint16Array : Uint32Array;
      this.triangles = maps.numbersOf(page.triangles, Index);
      this.count = this.triangles.length / 3;
      // From the middle of the object, subtracted in double: far from the origin, floats of the GPU would lose pixels.
      this.positions = maps.numbersOf(page.positions, Float32Array).map((x, i) => x - page.camera.center[i % 3]);
      this.edges = maps.directedEdges(this.triangles, this.positions.length / 3);
      this.mesh = this.meshOf(maps.numbersOf(page.frames, Float32Array));

      const n = page.samples, coded = (kind) => page.coding[kind] !== "bytes", most = (kind) => Math.max(1, ...page.counts.map((of) => of[kind]));
      this.surface = this.texturesOf({ isPatch: true, size: n, channels: page.packed ? 3 : 1, isCoded: coded("surface") }, most("surface"), page.counts.length, page.isSigned);
      this.view = this.texturesOf({ isPatch: false, size: page.viewSize, channels: 3, isCoded: coded("view") }, most("view"), page.counts.length, page.isSigned, gl.LINEAR);
      this.mean = this.texturesOf({ isPatch: true, size: n, channels: 3, isCoded: coded("mean") }, page.mean?.count ?? 1, 1, false);

      // The mean's places, then term after term: those of its surface maps, and of the view maps of the corners.
      this.placesOfTerm = page.packed ? 4 : 6;
      this.places = new Float32Array(4 * maps.side * Math.ceil(this.count * (1 + page.counts.length * this.placesOfTerm) / maps.side));
      const rows = maps.rowsOf(n, 3 * this.count), rowsOfTerm = rows.perLine * rows.height * rows.layers;
      const hasEdges = page.edges; // false where maps agree on all edges
      this.surfaceRows = { ...rows, texture: this.arrayTexture(gl.RG8_SNORM, hasEdges.surface ? rows : { width: 1, height: 1, layers: 1 }, hasEdges.surface ? page.counts.length : 1, gl.LINEAR) };
      this.meanRows = { ...rows, texture: this.arrayTexture(gl.RGBA8_SNORM, hasEdges.mean ? rows : { width: 1, height: 1, layers: 1 }, 1, gl.LINEAR) };
      this.placesTexture = gl.createTexture();

      this.maps = picture.programOf(gl, vertexShader, fragmentShader(page, { triangles: this.count, placesOfTerm: this.placesOfTerm,
        rowsOfTerm, edges: rows, surfaceEdges: hasEdges.surface, meanEdges: hasEdges.mean }));
      this.resolve = picture.programOf(gl, wholePicture, resolveShader);
      gl.useProgram(this.maps.program);
      ["surfaceMaps", "viewMaps", "meanMaps", "places", "surfaceEdges", "meanEdges"].forEach((name, unit) => gl.uniform1i(this.maps.at[name], unit));
      const valueOf = ({ tiling }) => (page.isSigned && tiling.shape.isCoded ? [255 / 127, -128 / 127] : [1, 0]);
      gl.uniform2fv(this.maps.at.surfaceValue, valueOf(this.surface));
      gl.uniform2fv(this.maps.at.viewValue, valueOf(this.view));
      if (page.mean) this.addMean(maps.tableOf(page.mean));
      this.uploadPlaces();
      this.targets = null;
      this.checkMemory();
    }

    meshOf(frames) {
      const { gl, triangles, positions } = this, corners = triangles.length, values = new Float32Array(7 * 3 * corners);
      const put = (to, from, at) => { for (let c = 0; c < 3; ++c) values[to + c] = from[at + c]; };
      for (let i = 0; i < corners; ++i) {
        put(21 * i, positions, 3 * triangles[i]);
        for (let corner = 0; corner < 3; ++corner) {
          const vertex = triangles[i - i % 3 + corner];
          put(21 * i + 3 + 3 * corner, frames, 6 * vertex);
          put(21 * i + 12 + 3 * corner, frames, 6 * vertex + 3);
        }
      }
      const mesh = gl.createVertexArray();
      gl.bindVertexArray(mesh);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      for (let location = 0; location < 7; ++location) {
        gl.enableVertexAttribArray(location);
        gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 84, 12 * location);
      }
      gl.bindVertexArray(null);
      return mesh;
    }

    arrayTexture(format, { width, height, layers }, times, filter) {
      const { gl } = this, texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
      gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, format, width, height, layers * times);
      for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, filter], [gl.TEXTURE_MAG_FILTER, filter],
        [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) gl.texParameteri(gl.TEXTURE_2D_ARRAY, name, value);
      return texture;
    }

    // Empty textures of maps of a shape, `most` of them in each of so many terms.
    texturesOf(shape, most, terms, isSigned, filter = this.gl.NEAREST) {
      const { gl, s3tc } = this, tiling = maps.tilingOf(shape, most), isBlocks = shape.isCoded && s3tc !== null;
      const format = isBlocks ? s3tc.COMPRESSED_RGB_S3TC_DXT1_EXT : isSigned && !shape.isCoded ? gl.RGBA8_SNORM : gl.RGBA8;
      const size = { width: tiling.columns * tiling.width, height: tiling.rows * tiling.height, layers: tiling.layers };
      return { tiling, size, isBlocks, format, texture: this.arrayTexture(format, size, Math.max(1, terms), filter) };
    }

    // Fills the layers of a term; returns its texels, or null if nobody asks for them.
    fill(textures, term, table, isAsked) {
      const { gl } = this, { tiling, size } = textures, layers = maps.layersOf(tiling, table);
      const decoded = () => maps.decodedBlocks(layers, size.width, size.height * size.layers);
      const texels = !tiling.shape.isCoded ? layers : isAsked || !textures.isBlocks ? decoded() : null;
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, textures.texture);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      const box = [0, 0, term * size.layers, size.width, size.height, size.layers];
      if (textures.isBlocks) gl.compressedTexSubImage3D(gl.TEXTURE_2D_ARRAY, 0, ...box, textures.format, layers);
      else if (textures.format === gl.RGBA8) gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, ...box, gl.RGBA, gl.UNSIGNED_BYTE, texels);
      else gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, ...box, gl.RGBA, gl.BYTE, new Int8Array(texels.buffer));
      return texels;
    }

    // Code of a sample of a map: that of a signed byte within -127..127, or of an unsigned one.
    codeReader({ tiling, size }, texels, isSigned) {
      return ([x, y, layer, code], [i, j], channel) => {
        if (code === 0) return 0;
        const step = Math.sign(code), byte = texels[4 * ((layer * size.height + y + step * j) * size.width + x + step * i) + channel];
        if (!isSigned) return byte;
        return Math.max(-127, tiling.shape.isCoded ? byte - 128 : byte << 24 >> 24);
      };
    }

    fillRows(rows, term, format, corrections) {
      const { gl } = this, channels = format === gl.RG ? 2 : 4, texels = new Int8Array(channels * rows.width * rows.height * rows.layers);
      texels.set(corrections);
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, rows.texture);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, term * rows.layers, rows.width, rows.height, rows.layers, format, gl.BYTE, texels);
    }

    addMean(table) {
      const { page, count, edges } = this, n = page.samples, places = new Array(count);
      for (let t = 0; t < count; ++t) this.places.set(places[t] = maps.placeOf(this.mean.tiling, table.mapAt(t)), 4 * t);
      const texels = this.fill(this.mean, 0, table, page.edges.mean);
      if (!page.edges.mean) return;
      const codeAt = this.codeReader(this.mean, texels, false), rows = new Int8Array(4 * 3 * count * n);
      for (let channel = 0; channel < 3; ++channel) {
        const found = maps.corrections(edges, n, true, (t, corner, s, step) => codeAt(places[t], maps.onSide(n, corner, s, step, 0), channel));
        for (let i = 0; i < found.length; i += 2) rows[2 * i + channel] = found[i]; // side 0
      }
      this.fillRows(this.meanRows, 0, this.gl.RGBA, rows);
    }

    // Adds the next term: { surface, view: tables, scale: of each vertex }.
    addTerm(read) {
      const { page, count, edges, triangles, placesOfTerm } = this, n = page.samples, k = this.terms;
      const surface = maps.tableOf(read.surface), view = maps.tableOf(read.view), scale = maps.numbersOf(read.scale, Float32Array);
      const within = (textures, map) => {
        const place = maps.placeOf(textures.tiling, map);
        return place[3] === 0 ? none : [place[0], place[1], place[2] + k * textures.size.layers, place[3]];
      };
      let at = 4 * count * (1 + k * placesOfTerm);
      const put = (place) => { this.places.set(place, at); at += 4; };
      for (let t = 0; t < count; ++t) {
        if (page.packed) put(within(this.surface, surface.mapAt(t)));
        else for (let corner = 0; corner < 3; ++corner) put(within(this.surface, surface.mapAt(3 * t + corner)));
        for (let corner = 0; corner < 3; ++corner) {
          const vertex = triangles[3 * t + corner], [x, y, layer, code] = within(this.view, view.mapAt(vertex));
          put([x, y, layer, code * scale[vertex]]);
        }
      }
      this.fill(this.view, k, view, false);
      const texels = this.fill(this.surface, k, surface, page.edges.surface);
      if (page.edges.surface) {
        const codeAt = this.codeReader(this.surface, texels, page.isSigned), { tiling } = this.surface;
        this.fillRows(this.surfaceRows, k, this.gl.RG, maps.corrections(edges, n, false, (t, corner, s, step) => {
          const place = maps.placeOf(tiling, surface.mapAt(page.packed ? t : 3 * t + corner));
          return codeAt(place, maps.onSide(n, corner, s, step, page.packed ? 0 : corner), page.packed ? corner : Math.max(0, Math.abs(place[3]) - 1));
        }));
      }
      ++this.terms;
      this.uploadPlaces();
      this.checkMemory();
    }

    uploadPlaces() {
      const { gl, places } = this;
      gl.bindTexture(gl.TEXTURE_2D, this.placesTexture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, maps.side, places.length / 4 / maps.side, 0, gl.RGBA, gl.FLOAT, places);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
    }

    // Tells visitors where memory does not suffice, which would else show as black.
    checkMemory(isComplete = true) {
      const { gl } = this;
      if (gl.getError() === gl.OUT_OF_MEMORY || (!isComplete && !gl.isContextLost()))
        surflect.fail("The graphics memory of this device does not hold the object.");
    }

    // Most samples along each side of a pixel of a canvas, 2 or 1 or a part of 1, within mostSamples and the largest texture.
    finestOf(width, height) {
      const side = this.gl.getParameter(this.gl.MAX_TEXTURE_SIZE) / Math.max(width, height);
      const finest = Math.min(2, side, Math.sqrt(mostSamples / (width * height)));
      return finest >= 1 ? Math.floor(finest) : finest;
    }

    targetsOf(width, height) {
      const { gl } = this;
      if (this.targets?.width === width && this.targets.height === height) return this.targets;
      if (this.targets) {
        gl.deleteTexture(this.targets.roots);
        gl.deleteRenderbuffer(this.targets.depth);
        gl.deleteFramebuffer(this.targets.framebuffer);
      }
      const roots = gl.createTexture(), depth = gl.createRenderbuffer(), framebuffer = gl.createFramebuffer();
      gl.bindTexture(gl.TEXTURE_2D, roots);
      gl.texStorage2D(gl.TEXTURE_2D, 1, this.isHalf ? gl.RGBA16F : gl.RGBA8, width, height);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
      gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
      gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, roots, 0);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
      this.checkMemory(gl.checkFramebufferStatus(gl.FRAMEBUFFER) === gl.FRAMEBUFFER_COMPLETE);
      return (this.targets = { width, height, roots, depth, framebuffer });
    }

    // state: clipFromObject (16 numbers) and eye, both from the middle of the object; stops, background (linear). samples:
    // along each side of a pixel, at most those of finestOf(). Coarser pictures take a part of the targets.
    draw(state, width, height, samples) {
      const { gl } = this, finest = this.finestOf(width, height), perPixel = Math.min(samples, finest);
      const sizeOf = (each) => [width, height].map((pixels) => Math.max(1, Math.floor(pixels * each)));
      const size = sizeOf(perPixel), targets = this.targetsOf(...sizeOf(finest));
      gl.bindFramebuffer(gl.FRAMEBUFFER, targets.framebuffer);
      gl.viewport(0, 0, ...size);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.enable(gl.CULL_FACE);
      gl.useProgram(this.maps.program);
      gl.uniformMatrix4fv(this.maps.at.clipFromObject, false, state.clipFromObject);
      gl.uniform3fv(this.maps.at.eye, state.eye);
      gl.uniform1f(this.maps.at.rootScale, 2 ** (state.stops / 2));
      gl.uniform1i(this.maps.at.terms, this.terms);
      [[gl.TEXTURE_2D_ARRAY, this.surface.texture], [gl.TEXTURE_2D_ARRAY, this.view.texture], [gl.TEXTURE_2D_ARRAY, this.mean.texture],
        [gl.TEXTURE_2D, this.placesTexture], [gl.TEXTURE_2D_ARRAY, this.surfaceRows.texture], [gl.TEXTURE_2D_ARRAY, this.meanRows.texture]]
        .forEach(([kind, texture], unit) => { gl.activeTexture(gl.TEXTURE0 + unit); gl.bindTexture(kind, texture); });
      gl.bindVertexArray(this.mesh);
      gl.drawArrays(gl.TRIANGLES, 0, 3 * this.count);

      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl.bindVertexArray(null);
      gl.disable(gl.DEPTH_TEST);
      gl.disable(gl.CULL_FACE);
      gl.viewport(0, 0, width, height);
      gl.useProgram(this.resolve.program);
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, targets.roots);
      gl.uniform1i(this.resolve.at.roots, 0);
      gl.uniform1f(this.resolve.at.perPixel, perPixel);
      gl.uniform2i(this.resolve.at.size, ...size);
      gl.uniform3fv(this.resolve.at.background, state.background);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
  }

  surflect.ObjectDrawing = ObjectDrawing;
})();
