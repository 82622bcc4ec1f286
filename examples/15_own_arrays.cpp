#include <firn/firn.hpp>

#include <cstdio>

int main() {
    using Kernel = firn::QuadraticBSpline;
    const firn::Domain<3> box{.lower = {0, 0, 0}, .upper = {1, 1, 1}, .cell_size = 1.0 / 32};
    const auto jelly = firn::FixedCorotated<double>::from_young_poisson(1e5, 0.3);  // Pa
    const auto walls = firn::Walls<double, 3>::all({0, 0, 0}, {1, 1, 1}, {firn::Contact::slip, 0});

    // Your arrays, here of a ball at rest, with matrices row by row.
    const auto ball = firn::sample_sphere<3>({0.5, 0.4, 0.5}, 0.2, {.spacing = 1.0 / 64});
    const std::size_t n = ball.positions.size();
    std::vector<double> x(3 * n), v(3 * n), C(9 * n), F(9 * n), stress(9 * n);
    std::vector<double> mass(n, 1000 * ball.volume), volume(n, ball.volume);  // kg, m³
    for (std::size_t i = 0; i < 3 * n; ++i) {
        x[i] = ball.positions[i / 3][int(i % 3)];
        F[i / 3 * 9 + i % 3 * 4] = 1;
    }
    using Span = firn::StridedSpan<double>;  // has strides for arrays of structures or of components
    const firn::ForeignParticles<double, 3> particles{.position = Span::vectors<3>(x.data()),
                                                      .velocity = Span::vectors<3>(v.data()),
                                                      .affine = Span::matrices<3>(C.data(), true),
                                                      .stress = firn::symmetric_matrices<3>(stress.data()),
                                                      .mass = Span::scalars(mass.data()),
                                                      .volume = Span::scalars(volume.data()),
                                                      .state = {Span::matrices<3>(F.data(), true)}};
    firn::SparseGrid<double, 3> grid(box);
    firn::BlockPartition<3> order;
    const auto sort = [&] {  // finds an order; the particles stay where they are
        order = firn::partition_particles<Kernel>(particles, n, box);
        grid.activate(order);
    };
    sort();
    const firn::Coloured how{};
    const firn::Vec<double, 3> gravity{0, -9.81, 0};
    auto report = firn::update_stress(how, particles, order, jelly, box.cell_size);
    firn::parallel_region(how.threads, [&] {  // one region for all steps is faster than one per stage
        for (double time = 0, dt; time < 0.3; time += dt) {
            dt = firn::stable_time_step<Kernel>(box.cell_size, report.signal_speed, norm(gravity));
            if (report.sort_needed) sort();
            firn::p2g<Kernel, firn::Apic, firn::MlsForce>(how, particles, order, grid, dt);
            firn::grid_update(how, grid, dt, gravity, walls);
            report = firn::g2p<Kernel, firn::Apic, firn::MlsForce>(how, particles, order, grid, jelly, dt);
        }
    });
    std::printf("the ball's first particle is at a height of %.3f m\n", x[1]);
}
