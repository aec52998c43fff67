// Draws tiles under a light by WebGL 2.
"use strict";
(() => {
  const { programOf, srgb } = surflect.picture;

  const vertexShader = `#version 300 es
    uniform vec4 place;  // of the tile on the screen: left, bottom, right, top, in clip space
    out vec2 at;
    void main() {
      vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
      at = vec2(corner.x, 1.0 - corner.y);
      gl_Position = vec4(mix(place.xy, place.zw, corner), 0, 1);
    }`;

  // One texture a plane; samplers cannot be indexed by variables.
  function fragmentShader(page) {
    const planes = [...Array(page.planes).keys()];
    return `#version 300 es
    precision highp float;
    ${planes.map((k) => `uniform sampler2D plane${k};`).join(" ")}
    ${page.normals ? "uniform sampler2D normalX, normalY;" : ""}
    uniform vec3 weights[${page.planes + 1}];
    uniform float toe, gain, exponent, diffuse;
    uniform vec3 towards;
    uniform int show;
    in vec2 at;
    out vec4 color;
    ${srgb}
    void main() {
      vec3 e = weights[0];
      ${planes.map((k) => `e += weights[${k + 1}] * texture(plane${k}, at).r;`).join(" ")}
      vec3 root = max(e + toe, vec3(toe));
      vec3 linear = min(root * root - toe * toe, vec3(1));
      ${page.normals ? `if (show > 0) {
        vec2 n = 2.0 * vec2(texture(normalX, at).r, texture(normalY, at).r) - 1.0;
        vec3 normal = normalize(vec3(n, sqrt(max(0.0, 1.0 - dot(n, n)))));
        if (show == 1) { color = vec4(0.5 + 0.5 * normal, 1); return; }
        // [Malzbender 2001, §4.1]: k_d L C + k_s (N.H)^n; the relit picture holds the cosine.
        float highlight = pow(max(0.0, dot(normal, normalize(towards + vec3(0, 0, 1)))), exponent);
        float known = clamp(20.0 * dot(linear, vec3(0.2126, 0.7152, 0.0722)), 0.0, 1.0); // normals of black pixels are noise
        linear = diffuse * linear + (1.0 - diffuse) * known * highlight;
      }` : ""}
      color = vec4(srgb(gain * linear), 1);
    }`;
  }

  class Drawing {
    constructor(gl, page) {
      Object.assign(this, { gl, page, ...programOf(gl, vertexShader, fragmentShader(page)) });
      gl.useProgram(this.program);
      for (let k = 0; k < page.planes; ++k) gl.uniform1i(this.at[`plane${k}`], k);
      if (page.normals) {
        gl.uniform1i(this.at.normalX, page.planes);
        gl.uniform1i(this.at.normalY, page.planes + 1);
      }
      gl.uniform1f(this.at.toe, page.toe);
    }

    // state: weights, towards, stops, show (0 colour, 1 normals, 2 specular), exponent, diffuse.
    begin(state, width, height) {
      const { gl, at } = this;
      gl.viewport(0, 0, width, height);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT);
      gl.uniform3fv(at["weights[0]"], state.weights);
      gl.uniform3fv(at.towards, state.towards);
      gl.uniform1f(at.gain, 2 ** state.stops);
      gl.uniform1f(at.exponent, state.exponent);
      gl.uniform1f(at.diffuse, state.diffuse);
      gl.uniform1i(at.show, state.show);
    }

    // Draws a tile between two corners in pixels of the canvas, from the top left.
    tile(tile, left, top, right, bottom, width, height, isSharp) {
      const { gl } = this;
      tile.textures.forEach((texture, unit) => {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, isSharp ? gl.NEAREST : gl.LINEAR);
      });
      gl.uniform4f(this.at.place, 2 * left / width - 1, 1 - 2 * bottom / height, 2 * right / width - 1, 1 - 2 * top / height);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
  }

  surflect.Drawing = Drawing;
})();
