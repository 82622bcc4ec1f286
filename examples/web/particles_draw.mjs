// Draws balls, surfaces and rods with WebGL 2, with the shadows of a light from above.
import { frameOf, lightMatrix } from './camera.mjs';

const shadowPixels = 1024;
const textureWidth = 1024;
const smallPixels = 4; // balls of a smaller radius are drawn as discs, which are not hidden in part by each other
const unit = (x) => x.map((value) => value / Math.hypot(...x));
const lights = { 2: frameOf(unit([-0.3, 0.5, 1])), 3: frameOf(unit([0.42, 0.83, 0.36])) };

/** The colours of the kinds: six of bodies, rope, snow, stone, and pins. */
const palette = ['#cf5230', '#3d86c6', '#e3a73c', '#63a35c', '#9a66b5', '#2b93a8', '#b58e5c', '#eef3f8', '#8d9299',
    '#26292e'];
const themes = {
    light: { background: '#f4f3f0', ink: '#3a3e45', dark: 0 },
    dark: { background: '#14161a', ink: '#aab0b8', dark: 1 },
};
/** A colour #rrggbb in linear light. */
const linear = (colour) => [1, 3, 5].map((i) => (parseInt(colour.slice(i, i + 2), 16) / 255) ** 2.2);

const common = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
layout(std140) uniform View {
    mat4 clip, light_clip;      // depth from 0 to 1
    vec4 right, up, back, eye;  // back.w: 1 if the theme is dark
    vec4 light, light_right, light_up;  // to the light; light.w: 1 if the scene is 2D
    vec4 lower, upper, target;  // lower.w: 1 if rays of the light are drawn; target.w: distance of the camera
    vec4 background, ink;
    vec4 palette[10];
};
`;
const shading = `
uniform sampler2DShadow shadows;

/// The part of the light that arrives at x, looked up at \`taps\` places within \`spread\` of the map's width.
float light_at(vec3 x, float spread, int taps) {
    vec3 there = (light_clip * vec4(x, 1.0)).xyz;
    there.xy = there.xy * 0.5 + 0.5;
    if (any(lessThan(there.xy, vec2(0.0))) || any(greaterThan(there.xy, vec2(1.0)))) return 1.0;
    float sum = 0.0;
    for (int k = 0; k < taps; ++k) {
        float angle = 2.3999632 * float(k); // a sunflower's
        vec2 offset = spread * sqrt((float(k) + 0.5) / float(taps)) * vec2(cos(angle), sin(angle));
        sum += texture(shadows, vec3(there.xy + offset, there.z));
    }
    return sum / float(taps);
}
vec3 shown(vec3 colour) { return pow(clamp(colour, 0.0, 1.0), vec3(1.0 / 2.2)); }
vec3 colour_of(float kind) {
    float whole = floor(kind + 0.02);
    return mix(palette[int(whole)].rgb, vec3(1.0), 0.8 * max(kind - whole, 0.0));
}
/// The light that comes from a surface at x with this normal.
vec3 shaded(vec3 x, vec3 normal, vec3 colour, float direct, float gloss) {
    float facing = max(dot(normal, light.xyz), 0.0);
    float sky = mix(0.30, 0.56, 0.5 + 0.5 * mix(normal.y, normal.z, light.w));
    float low = mix(smoothstep(0.0, 0.25, x.y - lower.y), 1.0, light.w); // less of the sky is seen near the ground
    vec3 half_way = normalize(light.xyz + normalize(eye.xyz - x));
    float shine = gloss * pow(max(dot(normal, half_way), 0.0), 28.0) * direct;
    return shown(colour * (sky * mix(0.75, 1.0, low) + 0.80 * facing * direct) + shine);
}
`;

const vertexShaders = {
    ball: `
uniform sampler2D balls, kinds; // a texel for each ball: centre and radius; kind
uniform float growth; // radii are multiplied by this
uniform float least;  // and at least this, per distance of the camera
out vec2 on_disc;
flat out vec4 centre;
flat out float colour;
void main() {
    int width = textureSize(balls, 0).x, index = gl_VertexID / 3;
    ivec2 place = ivec2(index % width, index / width);
    vec4 ball = texelFetch(balls, place, 0);
    float kind = texelFetch(kinds, place, 0).r;
    vec2 q = vec2[3](vec2(0.0, 2.0), vec2(-1.7320508, -1.0), vec2(1.7320508, -1.0))[gl_VertexID % 3];
    float radius = max(ball.w * growth, least * target.w);
#ifdef SHADOW
    gl_Position = light_clip * vec4(ball.xyz + radius * (light_right.xyz * q.x + light_up.xyz * q.y), 1.0);
#else
    gl_Position = clip * vec4(ball.xyz + radius * (right.xyz * q.x + up.xyz * q.y), 1.0);
#endif
    gl_Position.z = 2.0 * gl_Position.z - gl_Position.w;
    on_disc = q;
    centre = vec4(ball.xyz, radius);
    colour = kind;
}`,
    mesh: `
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 across;
layout(location = 2) in float kind;
out vec3 x, normal;
out float colour;
void main() {
#ifdef SHADOW
    gl_Position = light_clip * vec4(position, 1.0);
#else
    gl_Position = clip * vec4(position, 1.0);
#endif
    gl_Position.z = 2.0 * gl_Position.z - gl_Position.w;
    x = position;
    normal = across;
    colour = kind;
}`,
    rod: `
layout(location = 0) in vec4 from; // one end, and the radius
layout(location = 1) in vec4 to;   // the other end, and the kind
out vec3 axis;
out float across;
flat out vec3 side, front;
flat out float colour, radius;
void main() {
    vec2 q = vec2[4](vec2(0.0, -1.0), vec2(1.0, -1.0), vec2(0.0, 1.0), vec2(1.0, 1.0))[gl_VertexID];
    vec3 along = normalize(to.xyz - from.xyz + vec3(1e-9, 0.0, 0.0));
    axis = mix(from.xyz, to.xyz, q.x);
#ifdef SHADOW
    side = normalize(cross(light.xyz, along));
    gl_Position = light_clip * vec4(axis + side * q.y * from.w, 1.0);
#else
    side = normalize(cross(normalize(eye.xyz - axis), along));
    gl_Position = clip * vec4(axis + side * q.y * from.w, 1.0);
#endif
    gl_Position.z = 2.0 * gl_Position.z - gl_Position.w;
    front = cross(along, side);
    across = q.y;
    colour = to.w;
    radius = from.w;
}`,
    plane: `
out vec3 x;
void main() {
    vec2 q = vec2[4](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(-1.0, 1.0), vec2(1.0, 1.0))[gl_VertexID];
    vec3 middle = 0.5 * (lower.xyz + upper.xyz), size = upper.xyz - lower.xyz;
    // The wall of a 2D scene lies behind it, and is larger, so that the camera sees its edges at those of the scene.
    if (light.w > 0.5) x = vec3(mix(target.xy, middle.xy + 0.5 * q * size.xy, 1.0 + 0.07 / target.w), -0.07);
    else x = vec3(target.x + 1.5 * target.w * q.x, lower.y - 0.002, target.z + 1.5 * target.w * q.y);
    gl_Position = clip * vec4(x, 1.0);
    gl_Position.z = 2.0 * gl_Position.z - gl_Position.w;
}`,
};
const fragmentShaders = {
    ball: `
#ifdef SMALL
const int taps = 1;
#else
const int taps = 4;
#endif
in vec2 on_disc;
flat in vec4 centre;
flat in float colour;
out vec4 pixel;
void main() {
    vec2 q = on_disc;
    float from_centre = length(q);
#ifdef SHADOW
    if (from_centre > 1.0) discard;
#else
    // The edge is softened through the samples that it covers.
    float cover = clamp((1.0 - from_centre) / max(fwidth(from_centre), 1e-4) + 0.5, 0.0, 1.0);
    if (cover <= 0.0) discard;
    vec3 normal = right.xyz * q.x + up.xyz * q.y + back.xyz * sqrt(max(1.0 - dot(q, q), 0.0));
    vec3 x = centre.xyz + centre.w * normal;
    // The shadow is looked up above the surface, or balls would shade themselves.
    float direct = light_at(x + centre.w * (1.2 * light.xyz + 0.5 * normal), 0.0035, taps);
    pixel = vec4(shaded(x, normal, colour_of(colour), direct, 0.14), cover);
#ifndef SMALL
    vec4 depth = clip * vec4(x, 1.0);
    gl_FragDepth = depth.z / depth.w;
#endif
#endif
}`,
    mesh: `
in vec3 x, normal;
in float colour;
out vec4 pixel;
void main() {
#ifndef SHADOW
    vec3 to_eye = normalize(eye.xyz - x), n = normalize(normal + vec3(0.0, 0.0, 1e-9));
    bool is_back = dot(n, to_eye) < 0.0;
    if (is_back) n = -n;
    // A little of the light that falls on the other side comes through.
    float direct = light_at(x + 0.025 * light.xyz + 0.012 * n, 0.004, 6);
    float through = 0.28 * max(-dot(n, light.xyz), 0.0) * direct;
    vec3 own = colour_of(colour);
    if (is_back && light.w < 0.5) own = mix(own, vec3(dot(own, vec3(0.4))), 0.35) * 0.85;
    pixel = vec4(shaded(x, n, own * (1.0 + through), direct, 0.07), 1.0);
#endif
}`,
    rod: `
in vec3 axis;
in float across;
flat in vec3 side, front;
flat in float colour, radius;
out vec4 pixel;
void main() {
#ifndef SHADOW
    float high = sqrt(max(1.0 - across * across, 0.0));
    vec3 normal = side * across + front * high, x = axis + radius * normal;
    vec4 depth = clip * vec4(x, 1.0);
    float direct = light_at(x + 2.0 * radius * light.xyz, 0.0035, 4);
    pixel = vec4(shaded(x, normal, colour_of(colour), direct, 0.1), 1.0);
    gl_FragDepth = depth.z / depth.w;
#endif
}`,
    plane: `
in vec3 x;
out vec4 pixel;
void main() {
    float dark = back.w;
    float direct = light_at(x, light.w > 0.5 ? 0.012 : 0.010, 12);
    vec3 plain = background.rgb * mix(1.05, 1.7, dark);
    if (light.w > 0.5) { // the wall behind a 2D scene
        vec2 y = mix(target.xy, x.xy, 1.0 / (1.0 + 0.07 / target.w));
        vec2 edge = min(y - lower.xy, upper.xy - y);
        float line = 1.0 - smoothstep(0.0, 1.5 * fwidth(x.x), min(edge.x, edge.y));
        plain = mix(plain, ink.rgb, 0.25 * line) * mix(mix(0.70, 0.45, dark), 1.0, direct);
        pixel = vec4(shown(plain), 1.0);
        return;
    }
    vec2 lines = x.xz * 4.0; // four squares a metre
    vec2 width = max(fwidth(lines), vec2(1e-4));
    vec2 to_line = abs(fract(lines - 0.5) - 0.5) / width;
    float line = clamp(1.0 - min(to_line.x, to_line.y), 0.0, 1.0) * clamp(0.35 / max(width.x, width.y), 0.0, 1.0);
    vec3 lit = mix(plain, ink.rgb, line * mix(0.11, 0.05, dark)) * mix(mix(0.52, 0.30, dark), 1.0, direct);
    float fade = 1.0 - smoothstep(0.35 * target.w, 1.1 * target.w, distance(x.xz, target.xz));
    pixel = vec4(shown(mix(background.rgb, lit, fade)), 1.0);
}`,
};

const viewFloats = 16 * 2 + 4 * (4 + 3 + 3 + 2 + palette.length);

export class Painter {
    theme = 'light';
    #gl;
    #programs = {};
    #buffers = {};
    #textures = []; // of the units 1 and 2
    #arrays = {};
    #counts = { balls: 0, triangles: 0, rods: 0, pins: 0, edges: 0 };
    #stage = null;

    /** @throws Error if the browser has no WebGL 2 */
    constructor(canvas) {
        this.canvas = canvas;
        const gl = this.#gl = canvas.getContext('webgl2', { antialias: true, alpha: false });
        if (!gl) throw new Error('This browser has no WebGL 2, which draws the scene. Open the page in a current ' +
            'browser, and switch on hardware acceleration in its settings if needed.');
        this.start();
    }

    /** Creates everything on the graphics device; again after its context was lost and restored. */
    start() {
        const gl = this.#gl;
        for (const name of Object.keys(vertexShaders)) {
            this.#programs[name] = this.#program(name, '');
            if (name !== 'plane') this.#programs[`${name}_shadow`] = this.#program(name, '#define SHADOW\n');
        }
        this.#programs.ball_small = this.#program('ball', '#define SMALL\n');
        this.#buffers = {};
        for (const name of ['view', 'vertices', 'vertexKinds', 'triangles', 'rods', 'edges'])
            this.#buffers[name] = gl.createBuffer();
        gl.bindBuffer(gl.UNIFORM_BUFFER, this.#buffers.view);
        gl.bufferData(gl.UNIFORM_BUFFER, 4 * viewFloats, gl.DYNAMIC_DRAW);
        gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, this.#buffers.view);
        this.#arrays = {
            balls: gl.createVertexArray(),
            rods: this.#array([['rods', 4, 32, 0], ['rods', 4, 32, 16]], true),
            edges: this.#array([['edges', 4, 32, 0], ['edges', 4, 32, 16]], true),
            mesh: this.#array([['vertices', 3, 24, 0], ['vertices', 3, 24, 12], ['vertexKinds', 1, 4, 0]], false),
            plane: gl.createVertexArray(),
        };
        gl.bindVertexArray(this.#arrays.mesh);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.#buffers.triangles);
        this.#textures = [null, gl.createTexture(), gl.createTexture()];
        for (const unit of [1, 2]) {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(gl.TEXTURE_2D, this.#textures[unit]);
            for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
                gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
        }
        gl.activeTexture(gl.TEXTURE0);
        this.shadows = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, this.shadows);
        gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, shadowPixels, shadowPixels);
        for (const [name, value] of [['COMPARE_MODE', 'COMPARE_REF_TO_TEXTURE'], ['COMPARE_FUNC', 'LEQUAL'],
            ['MIN_FILTER', 'LINEAR'], ['MAG_FILTER', 'LINEAR'], ['WRAP_S', 'CLAMP_TO_EDGE'],
            ['WRAP_T', 'CLAMP_TO_EDGE']]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${name}`], gl[value]);
        this.shadowTarget = gl.createFramebuffer();
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowTarget);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.shadows, 0);
        gl.drawBuffers([gl.NONE]);
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.LEQUAL);
    }

    #program(name, definitions) {
        const gl = this.#gl, program = gl.createProgram();
        const sources = [[gl.VERTEX_SHADER, vertexShaders[name]],
            [gl.FRAGMENT_SHADER, shading + fragmentShaders[name]]];
        for (const [kind, text] of sources) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, common.replace('\n', `\n${definitions}`) + text);
            gl.compileShader(shader);
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
            const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
            throw new Error(`The shader ${name} does not compile: ${logs.join(' ')}${gl.getProgramInfoLog(program)}`);
        }
        gl.uniformBlockBinding(program, gl.getUniformBlockIndex(program, 'View'), 0);
        return program;
    }

    /** A vertex array from [buffer, numbers, bytes from one to the next, first byte]. */
    #array(attributes, isInstanced) {
        const gl = this.#gl, array = gl.createVertexArray();
        gl.bindVertexArray(array);
        attributes.forEach(([buffer, size, stride, offset], location) => {
            gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers[buffer]);
            gl.enableVertexAttribArray(location);
            gl.vertexAttribPointer(location, size, gl.FLOAT, false, stride, offset);
            if (isInstanced) gl.vertexAttribDivisor(location, 1);
        });
        return array;
    }

    #fill(buffer, data) {
        const gl = this.#gl;
        gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers[buffer]);
        gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    }

    /** Fills the texture of a unit with arrays of numbers, `channels` for each texel. */
    #fillTexture(unit, arrays, channels, format, order) {
        const gl = this.#gl, all = arrays.reduce((sum, { length }) => sum + length, 0) / channels;
        const height = Math.ceil(all / textureWidth) || 1, data = new Float32Array(channels * textureWidth * height);
        let at = 0;
        for (const array of arrays) {
            data.set(array, at);
            at += array.length;
        }
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, this.#textures[unit]);
        gl.texImage2D(gl.TEXTURE_2D, 0, format, textureWidth, height, 0, order, gl.FLOAT, data);
        gl.activeTexture(gl.TEXTURE0);
    }

    /** Sets the scene's constants, as the worker gives them. */
    setStage(stage) {
        this.#stage = stage;
        const { lower, upper } = stage, edges = [], corner = (k) => lower.map((x, a) => (k >> a & 1 ? upper[a] : x));
        for (let k = 0; k < 8 && stage.isBox; ++k)
            for (let a = 0; a < 3; ++a)
                if (!(k >> a & 1)) edges.push(...corner(k), 0.0012 * stage.distance, ...corner(k | 1 << a), 8);
        this.#fill('edges', new Float32Array(edges));
        this.#counts.edges = edges.length / 8;
    }

    /** Takes over what the worker gives to draw. */
    show({ balls, ballKinds, vertices, vertexKinds, triangles, rods, pins }) {
        const gl = this.#gl, counts = this.#counts;
        for (const [name, data] of Object.entries({ vertices, vertexKinds, rods })) this.#fill(name, data);
        // Pins are drawn like balls, and follow them in the textures.
        const pinKinds = pins.filter((_, k) => k % 4 === 3).map((isHeld) => (isHeld ? 0 : 9));
        this.#fillTexture(1, [balls, pins.map((x, k) => (k % 4 === 3 ? 0 : x))], 4, gl.RGBA32F, gl.RGBA);
        this.#fillTexture(2, [ballKinds, pinKinds], 1, gl.R32F, gl.RED);
        if (triangles) {
            gl.bindVertexArray(this.#arrays.mesh);
            gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.DYNAMIC_DRAW);
            counts.triangles = triangles.length;
        }
        this.largest = 0;
        for (let k = 3; k < balls.length; k += 4) this.largest = Math.max(this.largest, balls[k]);
        Object.assign(counts, { balls: balls.length / 4, rods: rods.length / 8, pins: pins.length / 4 });
    }

    #fit() {
        const ratio = Math.min(devicePixelRatio || 1, 2), { canvas } = this;
        const size = [canvas.clientWidth, canvas.clientHeight].map((n) => Math.max(Math.round(n * ratio), 1));
        if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
        return size[0] / size[1];
    }

    #writeView(camera, aspect) {
        const gl = this.#gl, { dimension, lower, upper } = this.#stage, { right, up, back, eye } = camera.frame();
        const light = lights[dimension], theme = themes[this.theme], is2D = dimension === 2 ? 1 : 0;
        const spread = Math.hypot(...lower.map((x, a) => Math.min(upper[a] - x, 1.2 * camera.distance))) / 2;
        const middle = is2D ? lower.map((x, a) => (x + upper[a]) / 2) : camera.target;
        const data = new Float32Array(viewFloats);
        data.set(camera.clip(aspect), 0);
        data.set(lightMatrix(light, middle, spread), 16);
        const vectors = [[right, 0], [up, 0], [back, theme.dark], [eye, 0], [light.back, is2D], [light.right, 0],
            [light.up, 0], [lower, 0], [upper, 0], [camera.target, camera.distance],
            ...[theme.background, theme.ink, ...palette].map((colour) => [linear(colour), 1])];
        vectors.forEach(([vector, w], k) => data.set([...vector, w], 32 + 4 * k));
        gl.bindBuffer(gl.UNIFORM_BUFFER, this.#buffers.view);
        gl.bufferSubData(gl.UNIFORM_BUFFER, 0, data);
    }

    /** Draws one array with the program of this name. */
    #draw(name, array, shadow, count, { first = 0, growth = 1, least = 0 } = {}) {
        if (count === 0) return;
        const gl = this.#gl, program = this.#programs[name + (shadow ? '_shadow' : '')];
        gl.useProgram(program);
        gl.bindVertexArray(this.#arrays[array]);
        if (name === 'mesh') return gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
        if (name === 'plane') return gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
        if (name === 'rod') return gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
        gl.uniform1f(gl.getUniformLocation(program, 'growth'), growth);
        gl.uniform1f(gl.getUniformLocation(program, 'least'), least);
        gl.uniform1i(gl.getUniformLocation(program, 'balls'), 1);
        gl.uniform1i(gl.getUniformLocation(program, 'kinds'), 2);
        gl.drawArrays(gl.TRIANGLES, 3 * first, 3 * count);
    }

    draw(camera) {
        const gl = this.#gl, counts = this.#counts;
        if (!this.#stage || gl.isContextLost()) return;
        this.#writeView(camera, this.#fit());
        gl.bindTexture(gl.TEXTURE_2D, null);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadowTarget);
        gl.viewport(0, 0, shadowPixels, shadowPixels);
        gl.disable(gl.SAMPLE_ALPHA_TO_COVERAGE);
        gl.clear(gl.DEPTH_BUFFER_BIT);
        this.#draw('ball', 'balls', true, counts.balls);
        this.#draw('mesh', 'mesh', true, counts.triangles);
        this.#draw('rod', 'rods', true, counts.rods);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.bindTexture(gl.TEXTURE_2D, this.shadows);
        gl.viewport(0, 0, this.canvas.width, this.canvas.height);
        const { background } = themes[this.theme], [r, g, b] = linear(background).map((x) => x ** (1 / 2.2));
        gl.clearColor(r, g, b, 1);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        this.#draw('mesh', 'mesh', false, counts.triangles);
        this.#draw('rod', 'rods', false, counts.rods);
        gl.enable(gl.SAMPLE_ALPHA_TO_COVERAGE);
        const pixels = this.largest / (camera.distance * camera.tangent(this.canvas.width / this.canvas.height));
        const isSmall = pixels * this.canvas.height / 2 < smallPixels;
        this.#draw(isSmall ? 'ball_small' : 'ball', 'balls', false, counts.balls);
        this.#draw('ball', 'balls', false, counts.pins, { first: counts.balls, growth: 0, least: 0.0065 });
        gl.disable(gl.SAMPLE_ALPHA_TO_COVERAGE);
        this.#draw('rod', 'edges', false, counts.edges);
        this.#draw('plane', 'plane', false, 1);
    }

    /** Waits until everything is drawn. */
    finish() {
        this.#gl.readPixels(0, 0, 1, 1, this.#gl.RGBA, this.#gl.UNSIGNED_BYTE, new Uint8Array(4));
    }
}
