// Mouse, touch and keys on the canvas turn the camera, zoom, or pull and push the particles.
const turnPerPixel = 0.007; // rad
const turnPerKey = 0.08; // rad
const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/**
 * @param camera {OrbitCamera}
 * @param mode () => 'orbit', 'attract' or 'repel': the effect of the left button or a finger
 * @param force ({x, y, sign}) => void: called with the pointer's place x, y (-1 to 1) and whether it pulls (sign 1),
 *        pushes (-1) or does neither (0)
 */
export function listen(canvas, camera, mode, force) {
    const pointers = new Map(); // pointers that are down: id to [x, y]
    let forcing = null; // the id of the pointer that pulls or pushes

    const place = (event) => {
        const { left, top, width, height } = canvas.getBoundingClientRect();
        return { x: 2 * (event.clientX - left) / width - 1, y: 1 - 2 * (event.clientY - top) / height };
    };
    const spread = () => {
        const [[ax, ay], [bx, by]] = pointers.values();
        return Math.max(Math.hypot(ax - bx, ay - by), 1);
    };
    const pull = (event) => {
        const repels = (mode() === 'repel') !== event.shiftKey;
        force({ ...place(event), sign: repels ? -1 : 1 });
    };
    const release = () => {
        if (forcing === null) return;
        forcing = null;
        force({ x: 0, y: 0, sign: 0 });
    };

    canvas.addEventListener('pointerdown', (event) => {
        canvas.setPointerCapture(event.pointerId);
        pointers.set(event.pointerId, [event.clientX, event.clientY]);
        if (pointers.size > 1) return release(); // two fingers zoom
        if (event.button === 2 || mode() !== 'orbit') {
            forcing = event.pointerId;
            pull(event);
        }
    });
    canvas.addEventListener('pointermove', (event) => {
        const before = pointers.get(event.pointerId);
        if (!before) return;
        if (forcing === event.pointerId) pull(event);
        else if (pointers.size === 1)
            camera.turn((before[0] - event.clientX) * turnPerPixel, (event.clientY - before[1]) * turnPerPixel);
        const apart = pointers.size === 2 ? spread() : 0;
        pointers.set(event.pointerId, [event.clientX, event.clientY]);
        if (apart) camera.zoom(apart / spread());
    });
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) {
        canvas.addEventListener(end, (event) => {
            pointers.delete(event.pointerId);
            if (forcing === event.pointerId) release();
        });
    }
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
        event.preventDefault();
        camera.zoom(Math.exp(event.deltaY * (event.deltaMode ? 0.04 : 0.0012)));
    }, { passive: false });
    canvas.addEventListener('keydown', ({ key }) => {
        if (key in keys) camera.turn(...keys[key].map((sign) => sign * turnPerKey));
        if (key === '+' || key === '=') camera.zoom(0.92);
        if (key === '-') camera.zoom(1 / 0.92);
    });
}
