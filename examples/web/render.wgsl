// Draws particles as lit spheres, straight from the simulation's buffers, with their shadows, the obstacle, the ground
// and the box. A first pass writes only the depth of spheres and obstacle: from it the picture takes smooth normals, and
// how much of the sky a place sees.

struct View {
    clip: mat4x4<f32>,       // from metres
    light_clip: mat4x4<f32>, // the same for the shadow map
    right: vec4<f32>,        // of the camera; w: radius of a particle [m]
    up: vec4<f32>,           // w: size of a cell [m]
    back: vec4<f32>,         // w: speed that gets the last colour [m/s]
    light_right: vec4<f32>,  // of the light; w: width of a line [pixels]
    light_up: vec4<f32>,     // w: 1 if the page is dark
    light: vec4<f32>,        // towards it; w: 1 if colours show the speed
    lower: vec4<f32>,        // of the box [m]; w: its longest edge
    upper: vec4<f32>,        // w: how far normals follow the surface instead of each sphere, 0 to 1
    background: vec4<f32>,   // colours are linear; w: how dark crevices are, 0 to 1
    ink: vec4<f32>,          // of lines; w: gloss
    colours: array<vec4<f32>, 6>, // two of bodies, four of speeds
    pixels: vec4<f32>,       // width and height of the picture, nearest and farthest distance [m]
    rows: vec4<u32>,         // where place, corner and velocity begin; w: numbers in a row
    eye: vec4<f32>,          // [m]; w: half the height of the picture at distance 1
    obstacle: vec4<f32>,     // its centre [m]
    half_extents: vec4<f32>, // of the obstacle [m]
    rotation: vec4<f32>,     // of the obstacle, a quaternion with the real part first
    obstacle_colour: vec4<f32>,
}
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;
@group(0) @binding(3) var front: texture_depth_2d;
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
    if (any(middle < vec2(0.0)) || any(middle > vec2(1.0))) { return 1.0; }
    var sum = 0.0;
    for (var k = 0u; k < taps; k++) {
        let angle = 2.3999632 * f32(k); // a sunflower's
        let offset = spread * sqrt((f32(k) + 0.5) / f32(taps)) * vec2(cos(angle), sin(angle));
        sum += textureSampleCompareLevel(shadow_map, shadow_sampler, middle + offset, there.z);
    }
    return sum / f32(taps);
}

fn shown(colour: vec3<f32>) -> vec3<f32> { return pow(clamp(colour, vec3(0.0), vec3(1.0)), vec3(1.0 / 2.2)); }

// ---- what the depth of the picture tells ----

/// The distance along the view [m] of what is seen in a pixel.
fn distance_at(pixel: vec2<i32>) -> f32 {
    let near = view.pixels.z;
    let far = view.pixels.w;
    let inside = clamp(pixel, vec2<i32>(0), vec2<i32>(view.pixels.xy) - 1);
    return far * near / (far - textureLoad(front, inside, 0) * (far - near));
}
fn position_at(pixel: vec2<i32>, distance: f32) -> vec3<f32> {
    let q = (2.0 * (vec2<f32>(pixel) + 0.5) / view.pixels.xy - 1.0) * vec2(view.pixels.x / view.pixels.y, -1.0);
    return view.eye.xyz + distance * (view.eye.w * (view.right.xyz * q.x + view.up.xyz * q.y) - view.back.xyz);
}
/// Pixels that a length at some distance spans [m].
fn pixels_of(length: f32, distance: f32) -> f32 { return 0.5 * view.pixels.y * length / (view.eye.w * distance); }

fn spiral(k: u32, taps: u32, turn: f32) -> vec2<f32> {
    let angle = 2.3999632 * f32(k) + turn;
    return sqrt((f32(k) + 0.5) / f32(taps)) * vec2(cos(angle), sin(angle));
}

/// The normal of the plane nearest to what is seen around a pixel, or `otherwise` where there is no surface.
fn smooth_normal(pixel: vec2<i32>, distance: f32, otherwise: vec3<f32>) -> vec3<f32> {
    let radius = view.right.w;
    let reach = clamp(pixels_of(4.0 * radius, distance), 2.0, 40.0);
    var sums = vec3<f32>(0.0);     // x, y, distance
    var squares = vec3<f32>(0.0);  // x x, y y, x y
    var products = vec2<f32>(0.0); // x distance, y distance
    var count = 0.0;
    for (var k = 0u; k < 14u; k++) {
        let at = vec2<i32>(round(reach * spiral(k, 14u, 0.0)));
        let deeper = distance_at(pixel + at) - distance;
        if (abs(deeper) > 6.0 * radius) { continue; }
        let o = vec2<f32>(at);
        count += 1.0;
        sums += vec3(o, deeper);
        squares += vec3(o * o, o.x * o.y);
        products += o * deeper;
    }
    if (count < 6.0) { return otherwise; }
    let mean = sums / count;
    let a = squares / count - vec3(mean.xy * mean.xy, mean.x * mean.y);
    let b = products / count - mean.xy * mean.z;
    let determinant = a.x * a.y - a.z * a.z;
    if (determinant < 1e-3) { return otherwise; }
    let slope = vec2(b.x * a.y - b.y * a.z, b.y * a.x - b.x * a.z) / determinant; // [m/pixel]
    let middle = position_at(pixel, distance);
    let along_x = position_at(pixel + vec2(1, 0), distance + slope.x) - middle;
    let along_y = position_at(pixel + vec2(0, 1), distance + slope.y) - middle;
    let normal = normalize(cross(along_y, along_x));
    return select(-normal, normal, dot(normal, view.eye.xyz - middle) > 0.0);
}

/// The part of the sky that x sees, past what is within `reach` [m].
fn openness(pixel: vec2<i32>, x: vec3<f32>, normal: vec3<f32>, reach: f32) -> f32 {
    let radius = clamp(pixels_of(reach, dot(x - view.eye.xyz, -view.back.xyz)), 3.0, 90.0);
    let turn = 6.2831853 * fract(52.9829189 * fract(dot(vec2<f32>(pixel), vec2(0.06711056, 0.00583715))));
    var hidden = 0.0;
    for (var k = 0u; k < 14u; k++) {
        let there = pixel + vec2<i32>(round(radius * spiral(k, 14u, turn)));
        let to = position_at(there, distance_at(there)) - x;
        let apart = max(length(to), 1e-5);
        hidden += max(dot(normal, to) / apart - 0.12, 0.0) * (1.0 - smoothstep(0.6 * reach, 1.8 * reach, apart));
    }
    return 1.0 - view.background.w * min(1.6 * hidden / 14.0, 0.8);
}

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
    let pixel = vec2<i32>(sphere.position.xy);
    let away = dot(x - view.eye.xyz, -view.back.xyz);
    let shade = view.background.w;

    var lit = normal;
    var open = 1.0;
    if (shade > 0.0) {
        if (away < distance_at(pixel) + radius) {
            lit = normalize(mix(normal, smooth_normal(pixel, away, normal), view.upper.w));
            open = openness(pixel, x, lit, 9.0 * radius);
        } else {
            open = 1.0 - 0.4 * shade; // seen past the edge of a sphere in front
        }
    }
    // The shadow is looked up above the surface, or spheres would shade themselves.
    let direct = light_at(x + 1.5 * radius * view.light.xyz + 0.5 * radius * normal, 0.0035, 6u);
    let wrap = 0.35 * shade; // light that scatters within
    let facing = max((dot(lit, view.light.xyz) + wrap) / (1.0 + wrap), 0.0);
    let sky = mix(0.30, 0.62, 0.5 + 0.5 * lit.y) * open * mix(vec3(1.0), vec3(0.84, 0.93, 1.08), shade);
    let low = smoothstep(0.0, 0.25 * view.lower.w, x.y - view.lower.y); // less of the sky is seen near the ground
    let half_way = normalize(view.light.xyz + view.back.xyz);
    let gloss = view.ink.w * pow(max(dot(lit, half_way), 0.0), 24.0) * direct;
    let rim = view.ink.w * pow(1.0 - max(dot(lit, view.back.xyz), 0.0), 3.0) * open;
    let strength = mix(1.0, 0.8, shade);
    let colour = strength * sphere.colour * (sky * mix(0.75, 1.0, low) + 0.85 * facing * direct * mix(1.0, open, 0.4)) +
        gloss + select(0.0, rim, shade > 0.0);
    return Pixel(vec4(shown(colour), cover), depth.z / depth.w);
}

@fragment
fn sphere_depth_fragment(sphere: Sphere) -> @builtin(frag_depth) f32 {
    let q = sphere.on_disc;
    if (dot(q, q) > 1.0) { discard; }
    let normal = view.right.xyz * q.x + view.up.xyz * q.y + view.back.xyz * sqrt(max(1.0 - dot(q, q), 0.0));
    let depth = view.clip * vec4(sphere.centre + view.right.w * normal, 1.0);
    return depth.z / depth.w;
}

// ---- the obstacle: a box, or a mesh ----

struct Face {
    @builtin(position) position: vec4<f32>,
    @location(0) x: vec3<f32>,
    @location(1) @interpolate(flat) normal: vec3<f32>,
}

/// v turned by the obstacle's rotation.
fn turned(v: vec3<f32>) -> vec3<f32> {
    let r = view.rotation;
    return v + 2.0 * cross(r.yzw, cross(r.yzw, v) + r.x * v);
}

fn face_of(k: u32, clip: mat4x4<f32>) -> Face {
    let face = k / 6u;
    let axis = face % 3u;
    let side = select(-1.0, 1.0, face < 3u);
    let q = array(vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(-1.0, 1.0),
                  vec2(-1.0, 1.0), vec2(1.0, -1.0), vec2(1.0, 1.0))[k % 6u];
    var corner = vec3(0.0);
    var normal = vec3(0.0);
    corner[axis] = side;
    normal[axis] = side;
    corner[(axis + 1u) % 3u] = q.x;
    corner[(axis + 2u) % 3u] = q.y;
    let x = view.obstacle.xyz + turned(corner * view.half_extents.xyz);
    return Face(clip * vec4(x, 1.0), x, turned(normal));
}

@vertex
fn box_vertex(@builtin(vertex_index) k: u32) -> Face { return face_of(k, view.clip); }
@vertex
fn box_shadow_vertex(@builtin(vertex_index) k: u32) -> Face { return face_of(k, view.light_clip); }

fn lit_obstacle(position: vec4<f32>, x: vec3<f32>, normal: vec3<f32>) -> vec4<f32> {
    let direct = light_at(x + 0.012 * view.lower.w * normal, 0.006, 12u);
    let facing = max(dot(normal, view.light.xyz), 0.0);
    let open = openness(vec2<i32>(position.xy), x, normal, 14.0 * view.right.w);
    let sky = mix(0.34, 0.62, 0.5 + 0.5 * normal.y) * open;
    return vec4(shown(view.obstacle_colour.rgb * (sky + 0.8 * facing * direct)), 1.0);
}

@fragment
fn box_fragment(face: Face) -> @location(0) vec4<f32> { return lit_obstacle(face.position, face.x, face.normal); }

struct Solid {
    @builtin(position) position: vec4<f32>,
    @location(0) x: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

fn vertex_of(place: vec3<f32>, normal: vec3<f32>, clip: mat4x4<f32>) -> Solid {
    let x = view.obstacle.xyz + turned(place);
    return Solid(clip * vec4(x, 1.0), x, turned(normalize(normal)));
}

@vertex
fn mesh_vertex(@location(0) place: vec3<f32>, @location(1) normal: vec3<f32>) -> Solid {
    return vertex_of(place, normal, view.clip);
}
@vertex
fn mesh_shadow_vertex(@location(0) place: vec3<f32>, @location(1) normal: vec3<f32>) -> Solid {
    return vertex_of(place, normal, view.light_clip);
}

@fragment
fn mesh_fragment(solid: Solid) -> @location(0) vec4<f32> {
    return lit_obstacle(solid.position, solid.x, normalize(solid.normal));
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
    let reach = 2.6 * view.lower.w;
    let x = vec3(middle.x + reach * q.x, view.lower.y - 0.002 * view.lower.w, middle.z + reach * q.y);
    return Ground(view.clip * vec4(x, 1.0), x);
}

@fragment
fn ground_fragment(ground: Ground) -> @location(0) vec4<f32> {
    let middle = 0.5 * (view.lower.xyz + view.upper.xyz);
    let lines = 8.0 / view.lower.w * ground.x.xz; // eight squares along the box
    let width = max(fwidth(lines), vec2(1e-4));
    let to_line = abs(fract(lines - 0.5) - 0.5) / width;
    let line = clamp(1.0 - min(to_line.x, to_line.y), 0.0, 1.0) * clamp(0.35 / max(width.x, width.y), 0.0, 1.0);
    let direct = light_at(ground.x, 0.012, 16u);
    let dark = view.light_up.w;
    let plain = view.background.rgb * mix(1.04, 1.6, dark);
    let lit = mix(plain, view.ink.rgb, line * mix(0.10, 0.045, dark)) * mix(mix(0.52, 0.30, dark), 1.0, direct);
    var open = 1.0;
    if (view.background.w > 0.0) {
        open = openness(vec2<i32>(ground.position.xy), ground.x, vec3(0.0, 1.0, 0.0), 16.0 * view.right.w);
    }
    let fade = 1.0 - smoothstep(0.5, 2.0, distance(ground.x.xz, middle.xz) / view.lower.w);
    return vec4(shown(mix(view.background.rgb, lit * open, fade)), 1.0);
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
