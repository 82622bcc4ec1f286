// Draws a simulation with WebGPU, directly from the simulation's buffers, and what is around it.
import { frameOf, lightMatrix } from './camera.mjs';
import { longest, plainBox, plainLook } from './scene.mjs';

const samples = 4;
const shadowPixels = 1024;
const fullSpeed = 4; // m/s; it has the last colour
const light = frameOf([0.42, 0.83, 0.36].map((x) => x / Math.hypot(0.42, 0.83, 0.36)));

/** The colours of speeds from 0 to fullSpeed, for particles and for the page's legend. */
export const ramp = ['#33407f', '#1f8a95', '#7fbf62', '#f5d94e'];
export { fullSpeed };
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
        Object.assign(renderer, { device, canvas, context, module, format, speeds: false, isDark: false, sets: [],
            mesh: null, box: plainBox, look: plainLook });
        await renderer.#createPipelines();
        renderer.shadows = device.createTexture({ size: [shadowPixels, shadowPixels], format: 'depth32float',
            usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.TEXTURE_BINDING }).createView();
        renderer.sampler = device.createSampler({ compare: 'less', magFilter: 'linear', minFilter: 'linear' });
        return renderer;
    }

    async #createPipelines() {
        const { device } = this, { VERTEX, FRAGMENT } = GPUShaderStage;
        const uniforms = { binding: 0, visibility: VERTEX | FRAGMENT, buffer: {} };
        this.lightLayout = device.createBindGroupLayout({ entries: [uniforms] });
        this.viewLayout = device.createBindGroupLayout({ entries: [uniforms,
            { binding: 1, visibility: FRAGMENT, texture: { sampleType: 'depth' } },
            { binding: 2, visibility: FRAGMENT, sampler: { type: 'comparison' } },
            { binding: 3, visibility: FRAGMENT, texture: { sampleType: 'depth' } }] });
        this.particleLayout = device.createBindGroupLayout({ entries: [0, 1, 2, 3].map((binding) =>
            ({ binding, visibility: VERTEX, buffer: { type: 'read-only-storage' } })) });
        const over = { color: { srcFactor: 'src-alpha', dstFactor: 'one-minus-src-alpha' }, alpha: {} };
        const pictured = [this.viewLayout], particles = [this.viewLayout, this.particleLayout];
        const lit = [this.lightLayout, this.particleLayout];
        [this.shadowPipeline, this.sphereDepthPipeline, this.spherePipeline, this.groundPipeline, this.edgePipeline,
            this.boxPipelines] = await Promise.all([
            this.#pipeline('shadow', lit, this.#depthOnly('shadow_vertex', 'shadow_fragment')),
            this.#pipeline('sphere depth', lit, this.#depthOnly('sphere_vertex', 'sphere_depth_fragment')),
            this.#pipeline('sphere', particles, { multisample: { count: samples, alphaToCoverageEnabled: true } }),
            this.#pipeline('ground', pictured, { primitive: { topology: 'triangle-strip' } }),
            this.#pipeline('edge', pictured, { depthStencil: { format: 'depth24plus', depthWriteEnabled: false,
                depthCompare: 'less' } }, { blend: over }),
            this.#obstaclePipelines('box'),
        ]);
    }

    #pipeline(name, layouts, { vertex = {}, ...more } = {}, target = {}) {
        const { device, module, format } = this;
        return device.createRenderPipelineAsync({
            label: name, layout: device.createPipelineLayout({ bindGroupLayouts: layouts }),
            vertex: { module, entryPoint: `${name}_vertex`, ...vertex },
            fragment: { module, entryPoint: `${name}_fragment`, targets: [{ format, ...target }] },
            depthStencil: { format: 'depth24plus', depthWriteEnabled: true, depthCompare: 'less' },
            multisample: { count: samples }, ...more,
        });
    }

    #depthOnly(vertex, fragment, buffers = []) {
        const { module } = this;
        return { multisample: {}, vertex: { entryPoint: vertex, buffers },
            fragment: fragment && { module, entryPoint: fragment, targets: [] },
            depthStencil: { format: 'depth32float', depthWriteEnabled: true, depthCompare: 'less' } };
    }

    /** What draws an obstacle, a box or a mesh: its shadow, its depth and its picture. */
    async #obstaclePipelines(name, buffers = []) {
        const [shadow, depth, picture] = await Promise.all([
            this.#pipeline(`${name} shadow`, [this.lightLayout],
                this.#depthOnly(`${name}_shadow_vertex`, undefined, buffers)),
            this.#pipeline(`${name} depth`, [this.lightLayout],
                this.#depthOnly(`${name}_vertex`, undefined, buffers)),
            this.#pipeline(name, [this.viewLayout], { vertex: { buffers } })]);
        return { shadow, depth, picture };
    }

    /** Makes a mesh, see mesh.mjs, the obstacle that show() can have; null: that is a box. */
    async useMesh(mesh) {
        for (const buffer of this.mesh?.buffers ?? []) buffer.destroy();
        this.mesh = null;
        if (!mesh) return;
        this.meshPipelines ??= await this.#obstaclePipelines('mesh', [0, 1].map((shaderLocation) =>
            ({ arrayStride: 12, attributes: [{ shaderLocation, offset: 0, format: 'float32x3' }] })));
        const { VERTEX, INDEX, COPY_DST } = GPUBufferUsage;
        const { vertices, normals, triangles } = mesh;
        const buffers = [[vertices, VERTEX], [normals, VERTEX], [triangles, INDEX]].map(([numbers, usage]) => {
            const buffer = this.device.createBuffer({ size: numbers.byteLength, usage: usage | COPY_DST });
            this.device.queue.writeBuffer(buffer, 0, numbers);
            return buffer;
        });
        this.mesh = { buffers, indices: triangles.length };
    }

    /**
     * Sets what to draw.
     * @param sets of particles: { simulation, body, spacing, look }: the number of each particle's body, the spacing
     *        [m], and how they look
     * @param scene { cellSize, box, look, obstacle }: `obstacle` is null or { half_extents (of a box), position [m],
     *        rotation, colour }
     */
    show(sets, { cellSize, box, look, obstacle }) {
        for (const { bodies, uniforms } of this.sets) for (const buffer of [bodies, uniforms]) buffer.destroy();
        this.sets = sets.map((set) => this.#set(set));
        Object.assign(this, { cellSize, box, look, obstacle });
        if (this.front) this.#bindViews();
    }

    #set({ simulation, body, spacing, look }) {
        const { device } = this, { UNIFORM, STORAGE, COPY_DST } = GPUBufferUsage;
        const uniforms = device.createBuffer({ size: 512, usage: UNIFORM | COPY_DST });
        const bodies = device.createBuffer({ size: body.byteLength, usage: STORAGE | COPY_DST });
        device.queue.writeBuffer(bodies, 0, body);
        const [place, corner, velocity] = ['place', 'corner', 'velocity'].map((name) => simulation.component(name));
        const group = (layout, buffers) => device.createBindGroup({ layout,
            entries: buffers.map((buffer, binding) => ({ binding, resource: { buffer } })) });
        const { capacity } = simulation;
        return { simulation, uniforms, bodies, look, radius: look.radius * spacing,
            lightGroup: group(this.lightLayout, [uniforms]),
            particleGroup: group(this.particleLayout, [place.gpu, corner.gpu, velocity.gpu, bodies]),
            rows: [place.row * capacity, corner.row * capacity, velocity.row * capacity, capacity] };
    }

    #bindViews() {
        for (const set of this.sets)
            set.viewGroup = this.device.createBindGroup({ layout: this.viewLayout, entries: [
                { binding: 0, resource: { buffer: set.uniforms } }, { binding: 1, resource: this.shadows },
                { binding: 2, resource: this.sampler }, { binding: 3, resource: this.front.createView() }] });
    }

    setTheme(name) { this.isDark = name === 'dark'; }
    get theme() { return this.isDark ? this.look.dark : this.look.light; } // background and lines

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
            this.front?.destroy();
            this.front = this.device.createTexture({ size, format: 'depth32float',
                usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.TEXTURE_BINDING });
            this.#bindViews();
        }
        return this.size[0] / this.size[1];
    }

    #writeView(camera, aspect, { uniforms, rows, radius, look }) {
        const data = new Float32Array(128), { right, up, back, eye } = camera.frame(), { box, obstacle } = this;
        const middle = box.lower.map((x, a) => 0.5 * (x + box.upper[a])), size = longest(box);
        const lineWidth = Math.min(devicePixelRatio || 1, 2) * 1.1, [background, ink] = this.theme;
        data.set(camera.clip(aspect), 0);
        data.set(lightMatrix(light, middle, 0.9 * size), 16);
        const { position = [0, 0, 0], half_extents: half = [0, 0, 0], rotation = [1, 0, 0, 0], colour = '#000000' } =
            obstacle ?? {};
        const vectors = [[right, radius], [up, this.cellSize], [back, fullSpeed], [light.right, lineWidth],
            [light.up, this.isDark ? 1 : 0], [light.back, this.speeds ? 1 : 0], [box.lower, size],
            [box.upper, look.smooth], [linear(background), look.shade], [linear(ink), look.gloss],
            ...[...look.bodies, ...ramp].map((each) => [linear(each), 1]), [[...this.size, camera.near], camera.far],
            [[0, 0, 0], 0], [eye, camera.tangent(aspect)], [position, 0], [half, 0],
            [rotation.slice(0, 3), rotation[3]], [linear(colour), 1]];
        vectors.forEach(([vector, w], i) => data.set([...vector, w], 32 + 4 * i));
        new Uint32Array(data.buffer).set(rows, 32 + 4 * (vectors.length - 6));
        this.device.queue.writeBuffer(uniforms, 0, data);
    }

    draw(camera) {
        const aspect = this.#fit(), [{ lightGroup, viewGroup }] = this.sets;
        for (const set of this.sets) this.#writeView(camera, aspect, set);
        const encoder = this.device.createCommandEncoder();
        const drawn = (pass, pipeline, vertices) => {
            pass.setPipeline(pipeline);
            pass.draw(vertices);
        };
        const solid = this.mesh ? this.meshPipelines : this.boxPipelines;
        const drawObstacle = (pass, pipeline) => {
            if (!this.obstacle) return;
            if (!this.mesh) return drawn(pass, pipeline, 36);
            const [vertices, normals, triangles] = this.mesh.buffers;
            pass.setPipeline(pipeline);
            pass.setVertexBuffer(0, vertices);
            pass.setVertexBuffer(1, normals);
            pass.setIndexBuffer(triangles, 'uint32');
            pass.drawIndexed(this.mesh.indices);
        };
        const drawParticles = (pass, pipeline, group) => {
            for (const set of this.sets) {
                pass.setBindGroup(0, set[group]);
                pass.setBindGroup(1, set.particleGroup);
                drawn(pass, pipeline, 3 * set.simulation.particles);
            }
        };
        const drawDepth = (view, spheres, obstacle) => {
            const pass = encoder.beginRenderPass({ colorAttachments: [], depthStencilAttachment: { view,
                depthClearValue: 1, depthLoadOp: 'clear', depthStoreOp: 'store' } });
            pass.setBindGroup(0, lightGroup);
            drawObstacle(pass, obstacle);
            drawParticles(pass, spheres, 'lightGroup');
            pass.end();
        };
        drawDepth(this.shadows, this.shadowPipeline, solid.shadow);
        if (this.look.shade > 0 || this.obstacle) // otherwise it is not read
            drawDepth(this.front.createView(), this.sphereDepthPipeline, solid.depth);
        const [r, g, b] = [1, 3, 5].map((i) => parseInt(this.theme[0].slice(i, i + 2), 16) / 255);
        const pass = encoder.beginRenderPass({
            colorAttachments: [{ view: this.colour.createView(), clearValue: { r, g, b, a: 1 }, loadOp: 'clear',
                resolveTarget: this.context.getCurrentTexture().createView(), storeOp: 'discard' }],
            depthStencilAttachment: { view: this.depth.createView(), depthClearValue: 1, depthLoadOp: 'clear',
                depthStoreOp: 'discard' },
        });
        pass.setBindGroup(0, viewGroup);
        drawObstacle(pass, solid.picture);
        drawParticles(pass, this.spherePipeline, 'viewGroup');
        pass.setBindGroup(0, viewGroup);
        drawn(pass, this.groundPipeline, 4);
        drawn(pass, this.edgePipeline, 72);
        pass.end();
        this.device.queue.submit([encoder.finish()]);
    }
}
