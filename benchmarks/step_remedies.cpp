/// \file What remedies cost. The two cubes with volumetric policies, step/two_cubes_f_bar/coloured/threads:N and
/// _volume_filter; and the two cubes at rest side by side on a floor, step/on_floor_held/coloured/threads:N and
/// _mirrored: floors whose nodes behind are held and mirrored.
#include "step.hpp"

namespace {

using namespace scenes;
using Boundary = firn::Walls<float, 3>;

/// The two cubes at rest side by side. Their lowest particles are half a spacing above the floor of the domain.
Scene<3> on_floor() {
    Scene<3> scene = two_cubes<3>();
    for (std::size_t i = 0; i < 2; ++i) {
        Matter<3>& cube = scene.matter[i];
        cube.velocity = {};
        cube.spin = 0;
        const double h = scene.domain.cell_size;
        cube.samples.positions = firn::lattice_points<3>({(i == 0 ? 40 : 64) * h, 0, 50 * h}, {42, 42, 41}, h / 2, 0.1,
                                                         i + 1, cube.samples.positions.size());
    }
    return scene;
}

/// Registers step/SCENE/coloured/threads:N with a volumetric policy.
template <class Volume>
bool add_remedy(const std::string& scene_name, Scene<3> (*make_scene)(), firn::NodesBehind behind) {
    return add_coloured(scene_name, make_scene, [behind](const Scene<3>& scene, int threads) {
        auto walls = Boundary::all(firn::cast<float>(scene.domain.lower), firn::cast<float>(scene.domain.upper),
                                   {firn::Contact::separate, 0});
        walls.nodes_behind = behind;
        return make_simulation<firn::SimulationWith<3, firn::FixedCorotated<float>, Boundary, Volume>>(
            scene, firn::Coloured{threads}, walls);
    });
}

constexpr auto two = +[] { return two_cubes<3>(); };
const bool added[] = {
    add_remedy<firn::FBar>("two_cubes_f_bar", two, firn::NodesBehind::held),
    add_remedy<firn::VolumeFilter>("two_cubes_volume_filter", two, firn::NodesBehind::held),
    add_remedy<firn::OwnVolume>("on_floor_held", on_floor, firn::NodesBehind::held),
    add_remedy<firn::OwnVolume>("on_floor_mirrored", on_floor, firn::NodesBehind::mirrored),
};

}  // namespace
