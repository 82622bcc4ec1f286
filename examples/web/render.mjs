// Draws a simulation with WebGPU, directly from the simulation's buffers.
import { frameOf, lightMatrix } from './camera.mjs';
import { box } from './scene.mjs';

const samples = 4;
const shadowPixels = 1024;
const fullSpeed = 4; // m/s; it has the last colour
const radiusPerSpacing = 0.62;
const light = frameOf([0.42, 0.83, 0.36].map((x) => x / Math.hypot(0.42, 0.83, 0.36)));

/** The colours of speeds from 0 to fullSpeed, for particles and for the page's legend. */
export const ramp = ['#33407f', '#1f8a95', '#7fbf62', '#f5d94e'];
export { fullSpeed };
const bodyColours = ['#d9703f', '#3d86c6'];
const themes = {
    light: { background: '#f4f3f0', ink: '#3a3e45', dark: 0 },
    dark: { background: '#14161a', ink: '#aab0b8', dark: 1 },
};

/** A colour #rrggbb in linear light. */
const linear = (colour) => [1, 3, 5].map((i) => (parseInt(colour.slice(i, i + 2), 16) / 255) ** 2.2);

export class Renderer {
    static async create(device, canvas) {
        const answer = await fetch(new URL('render.wgsl', import.meta.url));
        if (!answer.ok) throw new Error(`render.wgsl cannot be read: ${answer.status}.`);
        const module = device.createShaderModule({ label: 'render.wgsl', code: await answer.text() });
        const renderer = new Renderer();
        const format = navigator.gpu.getPreferredCanvasFormat();
        const context = canvas.getContext('webgpu');
        context.configure({ device, format, alphaMode: 'opaque' });
        Object.assign(renderer, { device, canvas, context, format, speeds: false, theme: themes.light });
        await renderer.#createPipelines(module);
        renderer.uniforms = device.createBuffer({ size: 416, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
        renderer.shadows = device.createTexture({ size: [shadowPixels, shadowPixels], format: 'depth32float',
            usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.TEXTURE_BINDING }).createView();
        const uniforms = { binding: 0, resource: { buffer: renderer.uniforms } };
        renderer.viewGroup = device.createBindGroup({ layout: renderer.viewLayout, entries: [uniforms,
            { binding: 1, resource: renderer.shadows },
            { binding: 2, resource: device.createSampler({ compare: 'less', magFilter: 'linear',
                minFilter: 'linear' }) }] });
        renderer.lightGroup = device.createBindGroup({ layout: renderer.lightLayout, entries: [uniforms] });
        return renderer;
    }

    async #createPipelines(module) {
        const { device, format } = this, { VERTEX, FRAGMENT } = GPUShaderStage;
        const uniforms = { binding: 0, visibility: VERTEX | FRAGMENT, buffer: {} };
        this.lightLayout = device.createBindGroupLayout({ entries: [uniforms] });
        this.viewLayout = device.createBindGroupLayout({ entries: [uniforms,
            { binding: 1, visibility: FRAGMENT, texture: { sampleType: 'depth' } },
            { binding: 2, visibility: FRAGMENT, sampler: { type: 'comparison' } }] });
        this.particleLayout = device.createBindGroupLayout({ entries: [0, 1, 2, 3].map((binding) =>
            ({ binding, visibility: VERTEX, buffer: { type: 'read-only-storage' } })) });
        const over = { color: { srcFactor: 'src-alpha', dstFactor: 'one-minus-src-alpha' }, alpha: {} };
        const create = (name, layouts, more, target = {}) => device.createRenderPipelineAsync({
            label: name, layout: device.createPipelineLayout({ bindGroupLayouts: layouts }),
            vertex: { module, entryPoint: `${name}_vertex` },
            fragment: { module, entryPoint: `${name}_fragment`, targets: [{ format, ...target }] },
            depthStencil: { format: 'depth24plus', depthWriteEnabled: true, depthCompare: 'less' },
            multisample: { count: samples }, ...more,
        });
        const pictured = [this.viewLayout], particles = [this.viewLayout, this.particleLayout];
        [this.shadowPipeline, this.spherePipeline, this.groundPipeline, this.edgePipeline] = await Promise.all([
            create('shadow', [this.lightLayout, this.particleLayout], { multisample: {},
                fragment: { module, entryPoint: 'shadow_fragment', targets: [] },
                depthStencil: { format: 'depth32float', depthWriteEnabled: true, depthCompare: 'less' } }),
            create('sphere', particles, { multisample: { count: samples, alphaToCoverageEnabled: true } }),
            create('ground', pictured, { primitive: { topology: 'triangle-strip' } }),
            create('edge', pictured, { depthStencil: { format: 'depth24plus', depthWriteEnabled: false,
                depthCompare: 'less' } }, { blend: over }),
        ]);
    }

    /** Sets what to draw. `body`: the number of each particle's body; `spacing` of particles and `cellSize` in m. */
    show(simulation, { body, spacing, cellSize }) {
        this.bodies?.destroy();
        this.bodies = this.device.createBuffer({ size: body.byteLength,
            usage: GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST });
        this.device.queue.writeBuffer(this.bodies, 0, body);
        const [place, corner, velocity] = ['place', 'corner', 'velocity'].map((name) => simulation.component(name));
        const buffers = [place.gpu, corner.gpu, velocity.gpu, this.bodies];
        this.particleGroup = this.device.createBindGroup({ layout: this.particleLayout,
            entries: buffers.map((buffer, binding) => ({ binding, resource: { buffer } })) });
        const { capacity, particles } = simulation;
        this.rows = [place.row * capacity, corner.row * capacity, velocity.row * capacity, capacity];
        Object.assign(this, { particles, cellSize, radius: radiusPerSpacing * spacing });
    }

    setTheme(name) { this.theme = themes[name]; }

    /** Fits the textures to the size of the canvas on the page. Returns width / height. */
    #fit() {
        const ratio = Math.min(devicePixelRatio || 1, 2), limit = this.device.limits.maxTextureDimension2D;
        const size = [this.canvas.clientWidth, this.canvas.clientHeight]
            .map((n) => Math.min(Math.max(Math.round(n * ratio), 1), limit));
        if (!this.colour || size[0] !== this.size[0] || size[1] !== this.size[1]) {
            this.colour?.destroy();
            this.depth?.destroy();
            [this.canvas.width, this.canvas.height] = this.size = size;
            const create = (format) => this.device.createTexture({ size, format, sampleCount: samples,
                usage: GPUTextureUsage.RENDER_ATTACHMENT });
            this.colour = create(this.format);
            this.depth = create('depth24plus');
        }
        return this.size[0] / this.size[1];
    }

    #writeView(camera, aspect) {
        const data = new Float32Array(104), { right, up, back } = camera.frame(), { theme } = this;
        const middle = box.lower.map((x, a) => 0.5 * (x + box.upper[a]));
        const lineWidth = Math.min(devicePixelRatio || 1, 2) * 1.1;
        data.set(camera.clip(aspect), 0);
        data.set(lightMatrix(light, middle, 0.9), 16);
        const vectors = [[right, this.radius], [up, this.cellSize], [back, fullSpeed], [light.right, lineWidth],
            [light.up, theme.dark], [light.back, this.speeds ? 1 : 0], [box.lower, 0], [box.upper, 0],
            ...[theme.background, theme.ink, ...bodyColours, ...ramp].map((colour) => [linear(colour), 1]),
            [[...this.size, 0], 0]];
        vectors.forEach(([vector, w], i) => data.set([...vector, w], 32 + 4 * i));
        new Uint32Array(data.buffer).set(this.rows, 32 + 4 * vectors.length);
        this.device.queue.writeBuffer(this.uniforms, 0, data);
    }

    draw(camera) {
        this.#writeView(camera, this.#fit());
        const encoder = this.device.createCommandEncoder();
        const shadow = encoder.beginRenderPass({ colorAttachments: [], depthStencilAttachment: { view: this.shadows,
            depthClearValue: 1, depthLoadOp: 'clear', depthStoreOp: 'store' } });
        const drawn = (pass, pipeline, vertices) => {
            pass.setPipeline(pipeline);
            pass.draw(vertices);
        };
        shadow.setBindGroup(0, this.lightGroup);
        shadow.setBindGroup(1, this.particleGroup);
        drawn(shadow, this.shadowPipeline, 3 * this.particles);
        shadow.end();
        const [r, g, b] = [1, 3, 5].map((i) => parseInt(this.theme.background.slice(i, i + 2), 16) / 255);
        const pass = encoder.beginRenderPass({
            colorAttachments: [{ view: this.colour.createView(), clearValue: { r, g, b, a: 1 }, loadOp: 'clear',
                resolveTarget: this.context.getCurrentTexture().createView(), storeOp: 'discard' }],
            depthStencilAttachment: { view: this.depth.createView(), depthClearValue: 1, depthLoadOp: 'clear',
                depthStoreOp: 'discard' },
        });
        pass.setBindGroup(0, this.viewGroup);
        pass.setBindGroup(1, this.particleGroup);
        drawn(pass, this.spherePipeline, 3 * this.particles);
        drawn(pass, this.groundPipeline, 4);
        drawn(pass, this.edgePipeline, 72);
        pass.end();
        this.device.queue.submit([encoder.finish()]);
    }
}
