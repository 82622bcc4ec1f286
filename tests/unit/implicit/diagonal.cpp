// quick: no
// sanitized: -O1
/// \file The diagonal blocks of the Hessian, against a dense matrix.
#include "support/implicit.hpp"
#include <firn/implicit/diagonal.hpp>

namespace implicit_diagonal_tests {
using namespace firn;
using namespace implicit_steps;

template <class Block>
void check(Block block, double displacement) {
    constexpr int D = Block::D;
    CAPTURE(Block::Material::name, Block::Force::name, Block::Kernel::support, D);
    const Numbers u = block.random_displacement(displacement, 5);
    block.put(u, block.of_u);
    auto potential = block.potential();
    REQUIRE(potential.displace(block.of_u).is_regular());
    aligned_vector<double> blocks{1, 2, 3};
    hessian_diagonal(potential, blocks);
    REQUIRE(blocks.size() == block.grid.block_count() * std::size_t(block_nodes<D> * D * D));
    const Eigen::MatrixXd K = block.hessian(u);
    double error = 0, all = 0, here = 0;
    for (const double number : blocks) all += number * number;
    for (int q = 0; q < int(block.nodes.size()); ++q) {
        const double* const of_node = blocks.data() + block.offsets[std::size_t(q)] / node_width * std::size_t(D * D);
        const Eigen::Matrix<double, D, D> expected = K.template block<D, D>(D * q, D * q),
                                          got = Eigen::Map<const Eigen::Matrix<double, D, D>>(of_node);
        error += (got - expected).squaredNorm(), here += got.squaredNorm();
    }
    CHECK(std::sqrt(error) <= 1e-13 * std::sqrt(all));
    CHECK(here == Approx(all).epsilon(1e-12));  // all other nodes have zeros
}

TEMPLATE_TEST_CASE_SIG("Diagonal blocks are those of the Hessian", "[implicit]", ((int D), D), 2, 3) {
    const int n = D == 2 ? 12 : 4;  // dense blocks and sparse ones
    using Solid = NeoHookean<double>;
    check(Block<QuadraticBSpline, WeightGradientForce, Solid, D>({}, 0.1, n, 7.7), 0.1);
    check(Block<QuadraticBSpline, MlsForce, Solid, D>({}, 0.1, n, 7.7), 0.1);
    check(Block<CubicBSpline, MlsForce, Hencky<double>, D>({}, 0.1), 0.1);
    check(Block<CompactQuartic, WeightGradientForce, Solid, D>({}, 0.1), 0.1);
    check(Block<QuadraticBSpline, MlsForce, Sand<double>, D>(Sand<double>::from_properties({}), 0.01), 0.01);
}

TEST_CASE("Diagonal blocks have the same bits for any number of threads", "[implicit]") {
    Block<QuadraticBSpline, WeightGradientForce, FixedCorotated<float>, 2> block({}, 0.05, 45, 7.7);
    block.put(block.random_displacement(0.05, 5), block.of_u);
    aligned_vector<float> expected, blocks;
    for (const int threads : {1, 2, 3}) {
        auto potential = block.potential(threads);
        REQUIRE(potential.displace(block.of_u).is_regular());
        hessian_diagonal(potential, threads == 1 ? expected : blocks);
        if (threads > 1) CHECK(blocks == expected);
    }
}

}  // namespace implicit_diagonal_tests
