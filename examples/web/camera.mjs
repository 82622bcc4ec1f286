// A camera that turns about a point. Matrices are stored column after column. Clip space is as in WebGPU: depth 0 to 1.
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / Math.hypot(...a));
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

function multiply(a, b) {
    const product = new Float32Array(16);
    for (let column = 0; column < 4; ++column)
        for (let row = 0; row < 4; ++row)
            for (let k = 0; k < 4; ++k) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
    return product;
}

/** Unit vectors to the right, up, and back towards a viewer who looks along -back. */
export function frameOf(back) {
    const right = unit(cross([0, 1, 0], back));
    return { right, up: cross(back, right), back };
}

const viewMatrix = ({ right, up, back }, eye) => [
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
];

/** The clip matrix of parallel light from `back`, for everything within `radius` of `centre`. */
export function lightMatrix(frame, centre, radius) {
    const eye = centre.map((x, a) => x + 2 * radius * frame.back[a]), r = 1 / radius;
    return multiply([r, 0, 0, 0, 0, r, 0, 0, 0, 0, -r / 3, 0, 0, 0, -1 / 6, 1], viewMatrix(frame, eye));
}

export class OrbitCamera {
    yaw = 0;
    pitch = 0;
    distance = 1; // m
    target = [0, 0, 0]; // m
    size = 1; // of what is seen [m]

    /** Looks from `distance` [m] in the direction of yaw and pitch at `target`, in a box of `size` [m]. */
    look({ target, distance, yaw, pitch }, size) { Object.assign(this, { target, distance, yaw, pitch, size }); }
    get near() { return 0.05 * this.size; }
    get far() { return 20 * this.size; }

    turn(yaw, pitch) {
        this.yaw += yaw;
        this.pitch = clamp(this.pitch + pitch, -0.1, 1.5);
    }
    zoom(factor) { this.distance = clamp(this.distance * factor, 0.5 * this.size, 6 * this.size); }

    /** Half the height of the picture at distance 1. Narrow pictures show the same width as square ones. */
    tangent(aspect) { return 0.36 / Math.min(1, aspect * 1.05); }

    frame() {
        const { yaw, pitch, distance, target } = this;
        const back = [Math.cos(pitch) * Math.sin(yaw), Math.sin(pitch), Math.cos(pitch) * Math.cos(yaw)];
        return { ...frameOf(back), eye: target.map((x, a) => x + distance * back[a]) };
    }

    clip(aspect) {
        const { near, far } = this, frame = this.frame(), f = 1 / this.tangent(aspect), d = near - far;
        const projection = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, far / d, -1, 0, 0, near * far / d, 0];
        return multiply(projection, viewMatrix(frame, frame.eye));
    }

    /** The place of a point [m] in the picture (x and y from -1 to 1, y up). */
    project([x, y, z], aspect) {
        const m = this.clip(aspect);
        const [px, py, , w] = [0, 1, 2, 3].map((r) => m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r]);
        return [px / w, py / w];
    }

    /** The ray through a point of the picture: its direction, its point nearest to the target, and how far that is. */
    ray(x, y, aspect) {
        const { right, up, back, eye } = this.frame(), t = this.tangent(aspect);
        const direction = unit(right.map((r, a) => r * x * t * aspect + up[a] * y * t - back[a]));
        const along = dot(this.target.map((c, a) => c - eye[a]), direction);
        return { direction, centre: eye.map((e, a) => e + along * direction[a]), distance: along };
    }
}
