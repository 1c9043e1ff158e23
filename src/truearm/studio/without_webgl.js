// In a browser without WebGL the page would stay empty: what shows messages lives in what draws. So what draws is given
// a context that does nothing, and a line says so. The page's own question whether there is WebGL, which comes without
// attributes, is answered as the browser answers it.
(() => {
  const real = HTMLCanvasElement.prototype.getContext;
  const has = (kind) => {
    try {
      return real.call(document.createElement("canvas"), kind) !== null;
    } catch {
      return false;
    }
  };
  if (has("webgl2")) return;

  const known = globalThis.WebGL2RenderingContext ?? {};
  const numbers = new Map();
  const constant = (name) => {
    if (name in known) return known[name];
    if (!numbers.has(name)) numbers.set(name, 0x100000 + numbers.size);
    return numbers.get(name);
  };
  const parameter = (name) => {
    if (name === constant("VERSION")) return "WebGL 2.0";
    if (name === constant("SHADING_LANGUAGE_VERSION")) return "WebGL GLSL ES 3.00";
    if (name === constant("VIEWPORT") || name === constant("SCISSOR_BOX")) return new Int32Array(4);
    return 16;
  };
  const nothing = () => null;
  const silent = (canvas) => {
    const given = {
      canvas,
      drawingBufferWidth: 1,
      drawingBufferHeight: 1,
      getContextAttributes: () => ({ alpha: true, depth: true, stencil: false, antialias: false }),
      isContextLost: () => false,
      getSupportedExtensions: () => [],
      getExtension: (name) => (name.startsWith("EXT_color_buffer_") ? {} : null),
      getParameter: parameter,
      getShaderPrecisionFormat: () => ({ rangeMin: 127, rangeMax: 127, precision: 23 }),
      getShaderParameter: () => true,
      getShaderInfoLog: () => "",
      getProgramInfoLog: () => "",
      getProgramParameter: (_, name) =>
        name === constant("ACTIVE_UNIFORMS") || name === constant("ACTIVE_ATTRIBUTES") ? 0 : true,
      getError: () => 0,
      checkFramebufferStatus: () => constant("FRAMEBUFFER_COMPLETE"),
    };
    return new Proxy(given, {
      get: (target, name) => {
        if (name in target) return target[name];
        if (typeof name !== "string") return undefined;
        if (name.startsWith("create") || name === "fenceSync") return () => ({});
        return /^[A-Z0-9_]+$/.test(name) ? constant(name) : nothing;
      },
    });
  };
  HTMLCanvasElement.prototype.getContext = function (kind, ...attributes) {
    if (kind === "webgl2" && attributes[0]) return silent(this);
    return real.call(this, kind, ...attributes);
  };

  addEventListener("DOMContentLoaded", () => {
    const said = document.createElement("div");
    said.id = "without-webgl";
    said.textContent = "This browser has no WebGL: the scene stays empty. Pages, tables and jobs work all the same.";
    said.style.cssText =
      "position:fixed;left:15px;top:30%;max-width:30em;padding:0.6em 1em;background:var(--mantine-color-body,#fff);color:var(--mantine-color-text,#222);" +
      "border-left:4px solid #c77700;font:15px sans-serif;z-index:100;pointer-events:none";
    document.body.append(said);
  });
})();
