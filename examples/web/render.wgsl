// Draws particles as lit spheres, straight from the simulation's buffers, with their shadows, the ground and the box.

struct View {
    clip: mat4x4<f32>,       // from metres
    light_clip: mat4x4<f32>, // the same for the shadow map
    right: vec4<f32>,        // of the camera; w: radius of a particle [m]
    up: vec4<f32>,           // w: size of a cell [m]
    back: vec4<f32>,         // w: speed that gets the last colour [m/s]
    light_right: vec4<f32>,  // of the light; w: width of a line [pixels]
    light_up: vec4<f32>,     // w: 1 if the page is dark
    light: vec4<f32>,        // towards it; w: 1 if colours show the speed
    lower: vec4<f32>,        // of the box [m]
    upper: vec4<f32>,
    background: vec4<f32>,   // colours are linear
    ink: vec4<f32>,          // of lines
    colours: array<vec4<f32>, 6>, // two of bodies, four of speeds
    pixels: vec4<f32>,       // width and height of the picture
    rows: vec4<u32>,         // where place, corner and velocity begin; w: numbers in a row
}
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;
@group(1) @binding(0) var<storage, read> places: array<f32>;
@group(1) @binding(1) var<storage, read> corners: array<f32>;
@group(1) @binding(2) var<storage, read> velocities: array<f32>;
@group(1) @binding(3) var<storage, read> bodies: array<u32>;

fn centre_of(i: u32) -> vec3<f32> {
    let n = view.rows.w;
    let p = view.rows.x + i;
    let c = view.rows.y + i;
    let place = vec3(places[p], places[p + n], places[p + 2u * n]);
    let corner = vec3(corners[c], corners[c + n], corners[c + 2u * n]);
    return view.lower.xyz + view.up.w * (corner + place);
}

fn colour_of(i: u32) -> vec3<f32> {
    if (view.light.w == 0.0) { return view.colours[bodies[i] % 2u].rgb; }
    let n = view.rows.w;
    let v = view.rows.z + i;
    let speed = length(vec3(velocities[v], velocities[v + n], velocities[v + 2u * n]));
    let t = clamp(3.0 * speed / view.back.w, 0.0, 2.9999);
    return mix(view.colours[2u + u32(t)].rgb, view.colours[3u + u32(t)].rgb, fract(t));
}

/// A triangle around the unit circle.
fn around_disc(k: u32) -> vec2<f32> {
    return array(vec2(0.0, 2.0), vec2(-1.7320508, -1.0), vec2(1.7320508, -1.0))[k];
}

// ---- shadows ----

struct Disc {
    @builtin(position) position: vec4<f32>,
    @location(0) on_disc: vec2<f32>,
}

@vertex
fn shadow_vertex(@builtin(vertex_index) k: u32) -> Disc {
    let q = around_disc(k % 3u);
    let x = centre_of(k / 3u) + view.right.w * (view.light_right.xyz * q.x + view.light_up.xyz * q.y);
    return Disc(view.light_clip * vec4(x, 1.0), q);
}

@fragment
fn shadow_fragment(disc: Disc) {
    if (dot(disc.on_disc, disc.on_disc) > 1.0) { discard; }
}

/// The part of the light that arrives at x, looked up at `taps` places within `spread` of the map's width.
fn light_at(x: vec3<f32>, spread: f32, taps: u32) -> f32 {
    let there = view.light_clip * vec4(x, 1.0);
    let middle = there.xy * vec2(0.5, -0.5) + 0.5;
    var sum = 0.0;
    for (var k = 0u; k < taps; k++) {
        let angle = 2.3999632 * f32(k); // a sunflower's
        let offset = spread * sqrt((f32(k) + 0.5) / f32(taps)) * vec2(cos(angle), sin(angle));
        sum += textureSampleCompareLevel(shadow_map, shadow_sampler, middle + offset, there.z);
    }
    return sum / f32(taps);
}

fn shown(colour: vec3<f32>) -> vec3<f32> { return pow(clamp(colour, vec3(0.0), vec3(1.0)), vec3(1.0 / 2.2)); }

// ---- particles ----

struct Sphere {
    @builtin(position) position: vec4<f32>,
    @location(0) on_disc: vec2<f32>,
    @location(1) @interpolate(flat) centre: vec3<f32>,
    @location(2) @interpolate(flat) colour: vec3<f32>,
}

struct Pixel {
    @location(0) colour: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

@vertex
fn sphere_vertex(@builtin(vertex_index) k: u32) -> Sphere {
    let q = around_disc(k % 3u);
    let centre = centre_of(k / 3u);
    let x = centre + view.right.w * (view.right.xyz * q.x + view.up.xyz * q.y);
    return Sphere(view.clip * vec4(x, 1.0), q, centre, colour_of(k / 3u));
}

@fragment
fn sphere_fragment(sphere: Sphere) -> Pixel {
    let q = sphere.on_disc;
    let from_centre = length(q);
    // The edge is softened through the samples that it covers.
    let cover = clamp((1.0 - from_centre) / max(fwidth(from_centre), 1e-4) + 0.5, 0.0, 1.0);
    if (cover <= 0.0) { discard; }
    let normal = view.right.xyz * q.x + view.up.xyz * q.y + view.back.xyz * sqrt(max(1.0 - dot(q, q), 0.0));
    let radius = view.right.w;
    let x = sphere.centre + radius * normal;
    let depth = view.clip * vec4(x, 1.0);

    // The shadow is looked up above the surface, or spheres would shade themselves.
    let direct = light_at(x + 1.5 * radius * view.light.xyz + 0.5 * radius * normal, 0.0035, 6u);
    let facing = max(dot(normal, view.light.xyz), 0.0);
    let sky = mix(0.30, 0.62, 0.5 + 0.5 * normal.y);
    let low = smoothstep(0.0, 0.25, x.y - view.lower.y); // less of the sky is seen near the ground
    let half_way = normalize(view.light.xyz + view.back.xyz);
    let gloss = 0.10 * pow(max(dot(normal, half_way), 0.0), 24.0) * direct;
    let colour = sphere.colour * (sky * mix(0.75, 1.0, low) + 0.85 * facing * direct) + gloss;
    return Pixel(vec4(shown(colour), cover), depth.z / depth.w);
}

// ---- ground ----

struct Ground {
    @builtin(position) position: vec4<f32>,
    @location(0) x: vec3<f32>,
}

@vertex
fn ground_vertex(@builtin(vertex_index) k: u32) -> Ground {
    let q = array(vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(-1.0, 1.0), vec2(1.0, 1.0))[k];
    let middle = 0.5 * (view.lower.xyz + view.upper.xyz);
    let x = vec3(middle.x + 2.6 * q.x, view.lower.y - 0.002, middle.z + 2.6 * q.y);
    return Ground(view.clip * vec4(x, 1.0), x);
}

@fragment
fn ground_fragment(ground: Ground) -> @location(0) vec4<f32> {
    let middle = 0.5 * (view.lower.xyz + view.upper.xyz);
    let lines = 8.0 * ground.x.xz; // eight squares a metre
    let width = max(fwidth(lines), vec2(1e-4));
    let to_line = abs(fract(lines - 0.5) - 0.5) / width;
    let line = clamp(1.0 - min(to_line.x, to_line.y), 0.0, 1.0) * clamp(0.35 / max(width.x, width.y), 0.0, 1.0);
    let direct = light_at(ground.x, 0.012, 16u);
    let dark = view.light_up.w;
    let plain = view.background.rgb * mix(1.04, 1.6, dark);
    let lit = mix(plain, view.ink.rgb, line * mix(0.10, 0.045, dark)) * mix(mix(0.52, 0.30, dark), 1.0, direct);
    let fade = 1.0 - smoothstep(0.5, 2.0, distance(ground.x.xz, middle.xz));
    return vec4(shown(mix(view.background.rgb, lit, fade)), 1.0);
}

// ---- the box's edges ----

struct Edge {
    @builtin(position) position: vec4<f32>,
    @location(0) across: f32,
}

@vertex
fn edge_vertex(@builtin(vertex_index) k: u32) -> Edge {
    let edge = k / 6u; // four along each axis
    let axis = edge / 4u;
    var low = vec3(0.0);
    low[(axis + 1u) % 3u] = f32(edge & 1u);
    low[(axis + 2u) % 3u] = f32((edge >> 1u) & 1u);
    var high = low;
    high[axis] = 1.0;
    let low_end = view.clip * vec4(mix(view.lower.xyz, view.upper.xyz, low), 1.0);
    let high_end = view.clip * vec4(mix(view.lower.xyz, view.upper.xyz, high), 1.0);
    let q = array(vec2(0.0, -1.0), vec2(1.0, -1.0), vec2(0.0, 1.0),
                  vec2(0.0, 1.0), vec2(1.0, -1.0), vec2(1.0, 1.0))[k % 6u];
    let end = select(low_end, high_end, q.x > 0.5);
    let along = normalize((high_end.xy / high_end.w - low_end.xy / low_end.w) * view.pixels.xy);
    let offset = vec2(-along.y, along.x) * q.y * (0.5 * view.light_right.w + 1.0) * 2.0 / view.pixels.xy;
    return Edge(vec4(end.xy + offset * end.w, end.zw), q.y * (0.5 * view.light_right.w + 1.0));
}

@fragment
fn edge_fragment(edge: Edge) -> @location(0) vec4<f32> {
    let cover = clamp(0.5 * view.light_right.w + 0.5 - abs(edge.across), 0.0, 1.0);
    return vec4(shown(view.ink.rgb), 0.42 * cover);
}
