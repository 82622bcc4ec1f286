/// \file The scenes of the page particles.html, as a WebAssembly module: makes a scene, sets its parameters, steps it,
/// passes the pointer on, and gives the addresses of what the page draws. The page calls the functions at the end.
#include "particles/snow_scene.hpp"
#include "particles/system_scenes.hpp"
#include "wasm/runtime.hpp"

namespace live {

std::unique_ptr<Scene> make_scene(std::string_view name, std::size_t particles, int threads) {
    if (name == "balls") return std::make_unique<Balls>(particles, threads);
    if (name == "bodies") return std::make_unique<Bodies>(particles, threads);
    if (name == "cloth") return std::make_unique<Cloth>(particles, threads);
    if (name == "pile") return std::make_unique<Pile>(particles, threads);
    if (name == "fountain") return std::make_unique<Fountain>(particles, threads);
    if (name == "snow") return std::make_unique<GridScene<firn::Snow<float>>>(particles, threads);
    if (name == "jelly") return std::make_unique<GridScene<firn::FixedCorotated<float>>>(particles, threads);
    throw firn::parameter_error(firn::sentence("There is no scene ", name,
                                               "; there are balls, bodies, cloth, pile, fountain, snow and jelly."));
}

namespace {

std::unique_ptr<Scene> scene;
Picture picture;
char text[256];  // a name, written by the page
/// The addresses of the arrays of `picture`, each followed by its number of entries.
std::uint32_t table[16];
double numbers[24];  // see live_describe()

std::string_view name(std::uint32_t length) { return {text, std::min<std::size_t>(length, sizeof text)}; }

Scene& present() {
    if (!scene) throw firn::usage_error("There is no scene yet; call live_make() first.");
    return *scene;
}

/// A line of sight from an eye along a direction of any length.
Ray ray(const double* x) {
    const Point along{x[3], x[4], x[5]};
    return {{x[0], x[1], x[2]}, along * (1 / norm(along))};
}

template <class T>
void list(std::size_t row, const std::vector<T>& array) {
    table[2 * row] = std::uint32_t(reinterpret_cast<std::uintptr_t>(array.data()));
    table[2 * row + 1] = std::uint32_t(array.size());
}

}  // namespace

}  // namespace live

/// Where the page writes a name of up to 256 bytes.
WASM_EXPORT(live_text) char* live_text() { return live::text; }
/// Where the page writes two lines of sight, each as eye and direction, and reads what live_describe() writes.
WASM_EXPORT(live_numbers) double* live_numbers() { return live::numbers; }

/// Makes the scene whose name is in the text, in place of the present one.
WASM_EXPORT(live_make) void live_make(std::uint32_t length, std::uint32_t particles, int threads) {
    live::scene.reset();
    live::picture = {};
    live::scene = live::make_scene(live::name(length), particles, threads);
}

/// Sets the parameter whose name is in the text. Returns 1, or 0 if the scene has no such parameter.
WASM_EXPORT(live_set) int live_set(std::uint32_t length, double value) {
    return live::present().set(live::name(length), value);
}

/// Writes the scene's constants into the numbers: dimension, target (3), lower (3) and upper (3) corner, distance, yaw
/// and pitch of the camera, and whether the edges of the box are drawn.
WASM_EXPORT(live_stage) void live_stage() {
    const live::Stage stage = live::present().stage();
    double* out = live::numbers;
    *out++ = stage.dimension;
    for (const live::Point& x : {stage.target, stage.lower, stage.upper})
        for (int a = 0; a < 3; ++a) *out++ = x[a];
    for (const double x : {stage.distance, stage.yaw, stage.pitch, double(stage.is_box)}) *out++ = x;
}

/// Takes `count` steps.
WASM_EXPORT(live_step) void live_step(int count) {
    for (int i = 0; i < count; ++i) live::present().step();
}

/// Writes into the numbers: time [s], time step [s], number of particles, number of links, index of the held point or
/// −1, and the mean position of the particles (3) [m].
WASM_EXPORT(live_describe) void live_describe() {
    const live::Scene& scene = live::present();
    const std::vector<live::Point> all = scene.positions();
    live::Point mean{};
    for (const live::Point& x : all) mean += x;
    mean = mean * (1 / std::max(1.0, double(all.size())));
    double* out = live::numbers;
    for (const double x : {scene.time(), scene.time_step(), double(all.size()), double(scene.links()),
                           double(scene.held()), mean[0], mean[1], mean[2]})
        *out++ = x;
}

/// Lists all particles and links. Returns a table of addresses and lengths: x, y, z of each particle [m], and the two
/// ends of each link.
WASM_EXPORT(live_net) std::uint32_t* live_net() {
    static std::vector<double> positions;
    static std::vector<std::uint32_t> ends;
    positions.clear();
    ends.clear();
    for (const live::Point& x : live::present().positions())
        for (int a = 0; a < 3; ++a) positions.push_back(x[a]);
    for (const auto& [a, b] : live::present().link_ends()) ends.insert(ends.end(), {a, b});
    live::list(0, positions);
    live::list(1, ends);
    return live::table;
}

/// Renews what the page draws. Returns a table of addresses and lengths: balls, kinds of balls, vertices, kinds of
/// vertices, triangles, rods, pins; and the version of the triangles.
WASM_EXPORT(live_draw) std::uint32_t* live_draw() {
    live::present().draw(live::picture);
    const live::Picture& picture = live::picture;
    live::list(0, picture.balls);
    live::list(1, picture.ball_kinds);
    live::list(2, picture.vertices);
    live::list(3, picture.vertex_kinds);
    live::list(4, picture.triangles);
    live::list(5, picture.rods);
    live::list(6, picture.pins);
    live::table[14] = picture.surface_version;
    return live::table;
}

/// Takes hold of the point on the line of sight in the numbers. Returns whether there is one.
WASM_EXPORT(live_grab) int live_grab(double slope) { return live::present().grab(live::ray(live::numbers), slope); }
/// Leads the held point to the line of sight in the numbers.
WASM_EXPORT(live_drag) void live_drag() { live::present().drag(live::ray(live::numbers)); }
WASM_EXPORT(live_release) void live_release() { live::present().release(); }
/// Pins or unpins the point on the line of sight in the numbers. Returns 1, −1, or 0 if there is none.
WASM_EXPORT(live_pin) int live_pin(double slope) { return live::present().pin(live::ray(live::numbers), slope); }
/// Cuts the links between the two lines of sight in the numbers. Returns their number.
WASM_EXPORT(live_cut) std::uint32_t live_cut() {
    return std::uint32_t(live::present().cut(live::ray(live::numbers), live::ray(live::numbers + 6)));
}
