// The part of the engine in the page: `runJob` takes a job as `engine.py` writes it, JSON, and returns
// {pixels: {target: {width, height, kind, data}}}, base64 with rows from the bottom, or {error: one text}.
// Everything a pass depends on is set by the pass, so no job sees what another one left behind.
"use strict";

(() => {
  const EXTENSIONS = {
    1: [
      "OES_texture_float", "OES_texture_float_linear", "OES_texture_half_float", "OES_texture_half_float_linear",
      "WEBGL_color_buffer_float", "EXT_color_buffer_half_float", "EXT_float_blend", "OES_element_index_uint",
      "OES_standard_derivatives", "EXT_frag_depth",
    ],
    2: ["EXT_color_buffer_float", "EXT_float_blend", "OES_texture_float_linear"],
  };

  // Name: [internal format, format, type], as the names of constants; WebGL 1 has no sized formats.
  const UNSIZED = {
    luminance8: ["LUMINANCE", "LUMINANCE", "UNSIGNED_BYTE"],
    alpha8: ["ALPHA", "ALPHA", "UNSIGNED_BYTE"],
    luminance_alpha8: ["LUMINANCE_ALPHA", "LUMINANCE_ALPHA", "UNSIGNED_BYTE"],
  };
  const FORMATS = {
    1: {
      ...UNSIZED,
      rgb8: ["RGB", "RGB", "UNSIGNED_BYTE"],
      rgba8: ["RGBA", "RGBA", "UNSIGNED_BYTE"],
      r32f: ["LUMINANCE", "LUMINANCE", "FLOAT"],
      rgba32f: ["RGBA", "RGBA", "FLOAT"],
      rgba16f: ["RGBA", "RGBA", "HALF_FLOAT_OES"],
    },
    2: {
      ...UNSIZED,
      r8: ["R8", "RED", "UNSIGNED_BYTE"],
      rg8: ["RG8", "RG", "UNSIGNED_BYTE"],
      rgb8: ["RGB8", "RGB", "UNSIGNED_BYTE"],
      rgba8: ["RGBA8", "RGBA", "UNSIGNED_BYTE"],
      srgb8_alpha8: ["SRGB8_ALPHA8", "RGBA", "UNSIGNED_BYTE"],
      r16f: ["R16F", "RED", "HALF_FLOAT"],
      rgba16f: ["RGBA16F", "RGBA", "HALF_FLOAT"],
      r32f: ["R32F", "RED", "FLOAT"],
      rgba32f: ["RGBA32F", "RGBA", "FLOAT"],
    },
  };

  const ARRAYS = { UNSIGNED_BYTE: Uint8Array, FLOAT: Float32Array, HALF_FLOAT: Uint16Array, HALF_FLOAT_OES: Uint16Array };
  const codeOf = (gl, type) => (type === "HALF_FLOAT_OES" ? 0x8d61 : gl[type]); // an extension's own

  const contexts = {};

  const mapped = (table, make) => Object.fromEntries(Object.entries(table).map(([k, v]) => [k, make(k, v)]));
  const decoded = (text) => Uint8Array.fromBase64(text).buffer;
  const encoded = (array) => new Uint8Array(array.buffer).toBase64();

  // One context for each version of WebGL, so that programs outlive the jobs.
  function contextOf(version) {
    const kept = contexts[version];
    if (kept && !kept.gl.isContextLost()) return kept;
    const gl = document.createElement("canvas").getContext(version === 2 ? "webgl2" : "webgl", {
      alpha: true, depth: true, stencil: false, antialias: false, premultipliedAlpha: true, preserveDrawingBuffer: true,
    });
    if (!gl) throw new Error(`no context of WebGL ${version}`);
    for (const name of EXTENSIONS[version]) {
      if (!gl.getExtension(name)) throw new Error(`WebGL ${version} without ${name}`);
    }
    return (contexts[version] = { gl, version, programs: new Map() });
  }

  function check(gl, doing) {
    const code = gl.getError();
    if (code === gl.NO_ERROR) return;
    const names = ["ENUM", "VALUE", "OPERATION", "FRAMEBUFFER_OPERATION"].map((name) => `INVALID_${name}`);
    throw new Error(`${names.find((name) => gl[name] === code) ?? `GL error ${code}`} while ${doing}`);
  }

  function formatOf(context, name) {
    const row = FORMATS[context.version][name];
    if (!row) throw new Error(`WebGL ${context.version} has no format ${name}`);
    return row;
  }

  function shaderOf(gl, kind, source) {
    const shader = gl.createShader(gl[kind]);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (gl.getShaderParameter(shader, gl.COMPILE_STATUS)) return shader;
    const numbered = source.split("\n").map((line, i) => `${String(i + 1).padStart(4)}  ${line}`).join("\n");
    throw new Error(`${kind} does not compile:\n${gl.getShaderInfoLog(shader)}\n${numbered}`);
  }

  function programOf({ gl, programs }, { vertex, fragment }) {
    const key = `${vertex}\0${fragment}`;
    if (!programs.has(key)) {
      const program = gl.createProgram();
      gl.attachShader(program, shaderOf(gl, "VERTEX_SHADER", vertex));
      gl.attachShader(program, shaderOf(gl, "FRAGMENT_SHADER", fragment));
      gl.linkProgram(program);
      if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
        throw new Error(`the program does not link:\n${gl.getProgramInfoLog(program)}`);
      }
      programs.set(key, program);
    }
    return programs.get(key);
  }

  function setSampling(gl, kind, filter) {
    const minified = { nearest: gl.NEAREST, linear: gl.LINEAR, "linear-mipmap-linear": gl.LINEAR_MIPMAP_LINEAR };
    gl.texParameteri(kind, gl.TEXTURE_MIN_FILTER, minified[filter]);
    gl.texParameteri(kind, gl.TEXTURE_MAG_FILTER, filter === "nearest" ? gl.NEAREST : gl.LINEAR);
    gl.texParameteri(kind, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(kind, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    if (kind === gl.TEXTURE_3D) gl.texParameteri(kind, gl.TEXTURE_WRAP_R, gl.CLAMP_TO_EDGE);
    if (filter === "linear-mipmap-linear") gl.generateMipmap(kind);
  }

  function upload(context, name, { format, size, filter, flip_y, data }) {
    const { gl } = context;
    const [internal, external, type] = formatOf(context, format);
    const kind = size.length === 3 ? gl.TEXTURE_3D : gl.TEXTURE_2D;
    if (kind === undefined) throw new Error(`texture ${name}: WebGL 1 has no 3-D textures`);
    const texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(kind, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, flip_y);
    gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    const values = new ARRAYS[type](decoded(data));
    const load = size.length === 3 ? "texImage3D" : "texImage2D";
    gl[load](kind, 0, gl[internal], ...size, 0, gl[external], codeOf(gl, type), values);
    setSampling(gl, kind, filter);
    check(gl, `texture ${name} was uploaded`);
    return { kind, texture };
  }

  function makeTarget(context, name, { format, width, height, filter, depth }) {
    const { gl } = context;
    const [internal, external, type] = formatOf(context, format);
    const made = { kind: gl.TEXTURE_2D, texture: gl.createTexture(), framebuffer: gl.createFramebuffer() };
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, made.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl[internal], width, height, 0, gl[external], codeOf(gl, type), null);
    setSampling(gl, gl.TEXTURE_2D, filter);
    gl.bindFramebuffer(gl.FRAMEBUFFER, made.framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, made.texture, 0);
    if (depth) {
      gl.bindRenderbuffer(gl.RENDERBUFFER, (made.depth = gl.createRenderbuffer()));
      gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_STENCIL, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_STENCIL_ATTACHMENT, gl.RENDERBUFFER, made.depth);
    }
    if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE) {
      throw new Error(`target ${name} of format ${format} cannot be drawn to`);
    }
    check(gl, `target ${name} was made`);
    return { ...made, width, height, read: type === "UNSIGNED_BYTE" ? "UNSIGNED_BYTE" : "FLOAT" };
  }

  function makeGeometry(gl, { attributes, indices, count }) {
    const filled = (kind, data) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(kind, buffer);
      gl.bufferData(kind, decoded(data), gl.STATIC_DRAW);
      return buffer;
    };
    return {
      count,
      attributes: mapped(attributes, (_, { size, data }) => ({ size, buffer: filled(gl.ARRAY_BUFFER, data) })),
      indices: filled(gl.ELEMENT_ARRAY_BUFFER, indices),
    };
  }

  function setUniforms(gl, program, values, textures) {
    let unit = 0;
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
      const { name: declared, type } = gl.getActiveUniform(program, i);
      const name = declared.replace(/\[0\]$/, "");
      const given = values[name];
      if (given === undefined) throw new Error(`uniform ${name} is not set`);
      const value = given.numbers ? Array.from(new Float64Array(decoded(given.numbers))) : given;
      const place = gl.getUniformLocation(program, declared);
      if (type === gl.SAMPLER_2D || type === gl.SAMPLER_3D) {
        if (!textures[value]) throw new Error(`uniform ${name}: no texture or target ${value}`);
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(textures[value].kind, textures[value].texture);
        gl.uniform1i(place, unit++);
      } else if ([gl.FLOAT_MAT2, gl.FLOAT_MAT3, gl.FLOAT_MAT4].includes(type)) {
        gl[`uniformMatrix${2 + type - gl.FLOAT_MAT2}fv`](place, false, value);
      } else {
        gl[setterOf(gl, type)](place, value);
      }
    }
  }

  function setterOf(gl, type) {
    for (const [name, letter] of [["FLOAT", "f"], ["INT", "i"], ["BOOL", "i"], ["UNSIGNED_INT", "ui"]]) {
      const at = [gl[name], ...[2, 3, 4].map((n) => gl[`${name}_VEC${n}`])].indexOf(type);
      if (at >= 0) return `uniform${at + 1}${letter}v`;
    }
    throw new Error(`a uniform of type 0x${type.toString(16)} is not known here`);
  }

  function setState(gl, { clear, clear_depth, depth_test, depth_write, cull, blend }) {
    gl.disable(gl.DITHER);
    gl.disable(gl.SCISSOR_TEST);
    gl.colorMask(true, true, true, true);
    gl.depthMask(true);
    if (clear) {
      gl.clearColor(...clear);
      gl.clearDepth(clear_depth);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    }
    const set = (capability, on) => (on ? gl.enable(capability) : gl.disable(capability));
    set(gl.DEPTH_TEST, depth_test);
    if (depth_test) gl.depthFunc(gl[depth_test.toUpperCase()]);
    gl.depthMask(depth_write);
    set(gl.CULL_FACE, cull !== "none");
    if (cull !== "none") gl.cullFace(gl[cull.toUpperCase()]);
    set(gl.BLEND, blend);
    if (blend) gl.blendFuncSeparate(...blend.map((factor) => gl[factor.toUpperCase()]));
  }

  function draw(gl, program, geometry) {
    const enabled = [];
    for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_ATTRIBUTES); i++) {
      const { name } = gl.getActiveAttrib(program, i);
      const place = gl.getAttribLocation(program, name);
      if (place < 0) continue; // gl_VertexID and its like
      const attribute = geometry.attributes[name];
      if (!attribute) throw new Error(`attribute ${name} is not in the geometry`);
      gl.bindBuffer(gl.ARRAY_BUFFER, attribute.buffer);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, attribute.size, gl.FLOAT, false, 0, 0);
      enabled.push(place);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, geometry.indices);
    gl.drawElements(gl.TRIANGLES, geometry.count, gl.UNSIGNED_INT, 0);
    enabled.forEach((place) => gl.disableVertexAttribArray(place));
  }

  function pixelsOf(gl, { framebuffer, width, height, read }) {
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.pixelStorei(gl.PACK_ALIGNMENT, 1);
    const pixels = new ARRAYS[read](width * height * 4);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl[read], pixels);
    return { width, height, kind: read, data: encoded(pixels) };
  }

  function run(job, context, held) {
    const { gl } = context;
    gl.canvas.width = job.width;
    gl.canvas.height = job.height;
    held.textures = mapped(job.textures, (name, given) => upload(context, name, given));
    held.targets = mapped(job.targets, (name, given) => makeTarget(context, name, given));
    held.geometries = job.geometries.map((given) => makeGeometry(gl, given));
    const canvas = { framebuffer: null, width: job.width, height: job.height, read: "UNSIGNED_BYTE" };
    const targets = { canvas, ...held.targets };
    const sources = { ...held.textures, ...held.targets };
    job.passes.forEach((pass, i) => {
      const program = programOf(context, pass.program);
      const target = targets[pass.target];
      if (!target) throw new Error(`pass ${i}: no target ${pass.target}`);
      gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
      gl.viewport(0, 0, target.width, target.height);
      gl.useProgram(program);
      setState(gl, pass);
      setUniforms(gl, program, pass.uniforms, sources);
      draw(gl, program, held.geometries[pass.geometry]);
      check(gl, `pass ${i} drew on ${pass.target}`);
    });
    const pixels = Object.fromEntries(job.read.map((name) => [name, pixelsOf(gl, targets[name])]));
    check(gl, "targets were read");
    return { pixels };
  }

  function release(gl, { textures = {}, targets = {}, geometries = [] }) {
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    [...Object.values(textures), ...Object.values(targets)].forEach(({ texture, framebuffer, depth }) => {
      gl.deleteTexture(texture);
      if (framebuffer) gl.deleteFramebuffer(framebuffer);
      if (depth) gl.deleteRenderbuffer(depth);
    });
    geometries.forEach(({ attributes, indices }) => {
      Object.values(attributes).forEach(({ buffer }) => gl.deleteBuffer(buffer));
      gl.deleteBuffer(indices);
    });
    while (gl.getError() !== gl.NO_ERROR && !gl.isContextLost());
  }

  globalThis.runJob = (text) => {
    const job = JSON.parse(text);
    const held = {};
    let context;
    try {
      context = contextOf(job.version);
      return run(job, context, held);
    } catch (error) {
      return { error: error.message };
    } finally {
      if (context) release(context.gl, held);
    }
  };
})();
