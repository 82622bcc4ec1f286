/// \file A dam breaks over houses, on one process or on many, and on any number of machines:
///
///     mpirun -n 4 18_many_machines --threads 2
///
/// All processes ("ranks") run this program. Each computes some of the water, and the bits of the result do not depend
/// on the number of ranks. A run may go on with --go-on on another number of ranks than it began on.
#include "support/ranks.hpp"
#include "support/run_schedule.hpp"
#include "support/solids.hpp"
#include <firn/firn.hpp>
#include <firn/mpi.hpp>
#include <firn/mpi/states.hpp>

namespace {

constexpr int D = 3;
using Point = firn::Vec<double, D>;
using Water = firn::Fluid<float>;
using House = firn::Collider<firn::Box<float, D>>;
using Boundary = firn::Together<firn::Walls<float, D>, House, House, House, House>;

constexpr Point upper{3.2, 1.2, 1.2};       // of the basin, whose lower corner is the origin [m]
constexpr Point reservoir{0.8, 0.85, 1.2};  // the water behind the dam

std::array<House, 4> houses() {
    const auto house = [](Point foot, Point size, double degrees) {
        House made{.shape = {firn::cast<float>(size * 0.5)}, .contact = firn::Contact::separate, .friction = 0.1};
        made.position = foot + Point{0.0, size[1] / 2, 0.0};
        made.rotation = firn::rotor({0.0, 1.0, 0.0}, firn::degrees(degrees));
        return made;
    };
    return {house({1.45, 0.0, 0.36}, {0.26, 0.5, 0.26}, 15), house({1.6, 0.0, 0.85}, {0.3, 0.3, 0.24}, -25),
            house({2.2, 0.0, 0.55}, {0.24, 0.75, 0.24}, 40), house({2.55, 0.0, 0.95}, {0.3, 0.35, 0.22}, 5)};
}

example::Surface surface_of_houses() {
    example::Surface surface;
    for (const House& house : houses()) {
        const Point half = firn::cast<double>(house.shape.half_extents);
        firn::TriangleMesh mesh = example::box_mesh(half * -1.0, half);
        for (Point& x : mesh.vertices) x = house.position + firn::matrix_of(house.rotation) * x;
        example::add_mesh(surface, mesh, example::slate);
    }
    return surface;
}

/// Returns the rank that computes the water at a point.
int owner(const firn::mpi::Cuts<D>& cuts, const firn::Domain<D>& domain, const Point& x) {
    firn::BlockCoordinate<D> block{};
    for (int a = 0; a < D; ++a)
        block[std::size_t(a)] = int(std::floor((x[a] - domain.lower[a]) / domain.cell_size)) >> 2;  // 4 cells wide
    return std::max(cuts.owner(block), 0);  // 0 also before the first cuts
}

/// Restores the simulation from the last state of a series, whatever number of ranks wrote it.
template <class Simulation>
example::Begun go_on(Simulation& simulation, firn::mpi::StateSeries& states, const example::Options& options) {
    const firn::mpi::Communicator& ranks = simulation.execution.communicator();
    int count = 0;
    std::string file, problem;
    if (ranks.rank() == 0) {
        try {
            const auto list = example::states_to_go_on_from(states.path());
            count = int(list.size());
            file = (options.output / list.back().file).string();
        } catch (const firn::io_error& found) {
            problem = found.what();
        }
    }
    problem = ranks.text_of(0, problem);
    if (!problem.empty()) firn::mpi::throw_together<firn::io_error>(ranks, 0, problem);
    file = ranks.text_of(0, file);
    try {
        example::restore_as(options, [&](firn::Restart how) {
            firn::mpi::restore(simulation, firn::mpi::read_state<float>(ranks, file), how);
        });
    } catch (const firn::io_error& of_all) {
        firn::mpi::throw_together<firn::io_error>(ranks, 0, of_all.what());
    }
    states.go_on_from(simulation.time());
    return {std::int64_t(simulation.steps()), ranks.max(count)};
}

int many_machines(int argc, char** argv) {
    const firn::mpi::Communicator ranks;
    const example::OneSpeaks one_speaks(ranks);

    example::CommandLine line({.name = "many_machines",
                               .about = "A dam breaks over houses. Run it by mpirun on several ranks.",
                               .particles = 150'000,
                               .steps = 3'000,
                               .frames = 30,
                               .can_go_on = true,
                               .writes_obj = false});
    double viscosity = 0;
    std::string colours = "matter";
    line.add("--viscosity", viscosity, "Viscosity of the water in Pa s", 0, 100);
    line.add("--colours", colours, "What the picture shows in colours: matter, or the ranks", {"matter", "ranks"});
    if (const auto exit_code = line.parse(argc, argv)) return *exit_code;
    example::Options options = line.options();
    if (!line.is_given("--threads")) options.threads = example::threads_of_rank(ranks);
    options.film = options.film && ranks.rank() == 0;
    if (ranks.size() > 1) std::cout << "on " << ranks.size() << " ranks, ";

    const double spacing = std::cbrt(reservoir[0] * reservoir[1] * reservoir[2] / double(options.particles));
    const firn::Domain<D> basin{{0, 0, 0}, upper, 2 * spacing};
    const auto walls = firn::Walls<float, D>::all({0, 0, 0}, firn::cast<float>(upper), {firn::Contact::separate, 0.0});
    const auto [a, b, c, d] = houses();
    firn::Simulation simulation(basin, Water::from_properties({.bulk = 3e5, .viscosity = viscosity}),
                                Boundary{walls, a, b, c, d},
                                firn::mpi::Distributed<firn::Coloured>({options.threads}, ranks));
    // Each rank gives all the samples, and keeps its share.
    simulation.add(firn::sample_box<D>({0, 0, 0}, reservoir, {.spacing = spacing, .pattern = firn::Pattern::jittered}),
                   1000);

    example::View view{.direction = {{-0.6F, -0.5F, -1.0F}}};
    view.frame = view.domain = example::Box{{}, firn::cast<float>(upper)};
    view.frame->upper[1] = 0.9F;
    view.height = 800;
    view.smoothing = 0.5F;
    firn::mpi::StateSeries states(ranks, options.output, options.name);
    const example::Begun begun = options.go_on ? go_on(simulation, states, options) : example::Begun{};
    // Rank 0 draws what the state on the disk says.
    const auto picture = [&] {
        if (ranks.rank() != 0) return example::Image{};
        const auto list = firn::read_series(states.path());
        const auto state = firn::read_state<float>(options.output / list.back().file);
        example::Cloud cloud;
        cloud.radius = float(0.6 * spacing);
        cloud.surface = surface_of_houses();
        const auto& x = state.field("position").values;
        for (std::size_t i = 0; i < state.size(); ++i) {
            const Point at{x[D * i], x[D * i + 1], x[D * i + 2]};
            cloud.positions.push_back(example::drawn(at));
            if (colours == "ranks") {
                cloud.colour.push_back(std::uint8_t(owner(simulation.execution.cuts<D>(), basin, at)));
            } else {
                cloud.colour.push_back(std::uint8_t(example::teal));
                cloud.look.push_back(example::Look::water);
            }
        }
        return example::render(cloud, view);
    };
    const auto particles = std::int64_t(ranks.sum(std::uint64_t(simulation.particles().size())));
    const example::Outcome outcome = example::run_schedule(
        options, [&] { return particles; }, begun, [&] { states.write(firn::state_of(simulation)); }, [] {},
        [&] { simulation.step(); }, picture, {states.path()},
        [&](const firn::Interruption& here) {
            return simulation.execution.interrupted() ? ranks.max(here.signal()) : 0;
        });
    return outcome.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
    firn::mpi::Session session(argc, argv);  // starts MPI; an exception on one rank ends all ranks
    return many_machines(argc, argv);
}
