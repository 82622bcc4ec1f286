// part: memory
/// \file Eigen's vectors and matrices where firn's are taken, and firn's as Eigen's: the same numbers, and nothing that
/// refers to what is gone. (The sanitized build sees a map of a temporary.)
#include "support/catch.hpp"
#include "support/message.hpp"
#include <firn/core/eigen.hpp>
#include <firn/core/lanes.hpp>
#include <firn/data/aligned.hpp>

#include <Eigen/Dense>

#include <functional>
#include <span>

using namespace firn;

namespace eigen_tests {

namespace {

using V = Vec<double, 3>;
using M = Mat<double, 3>;
const Eigen::Vector3d a(1, 2, 3), b(-4, 5, 0.5);
const Eigen::Matrix3d A = (Eigen::Matrix3d() << 1, 2, 3, 4, 5, 6, 7, 8, 10).finished();

V given(const V& x) { return x; }
M given_matrix(const M& x) { return x; }
V sum(double x, double y, double z) { return {x, y, z}; }

}  // namespace

// What passes through registers and memcpy still does.
static_assert(std::is_trivially_copyable_v<V> && std::is_trivially_default_constructible_v<M>);
static_assert(sizeof(Vec<float, 3>) == 12 && sizeof(Mat<native_pack<float>, 3>) == 9 * sizeof(native_pack<float>));
// Only what may have the right size, by its type.
static_assert(std::convertible_to<Eigen::Vector3d, V> && !std::convertible_to<Eigen::Vector2d, V> &&
              !std::convertible_to<Eigen::Matrix3d, V> && !std::convertible_to<Eigen::Vector3d, M> &&
              !std::convertible_to<Eigen::Matrix2d, M> && std::convertible_to<Eigen::MatrixXd, M> &&
              !std::convertible_to<Eigen::MatrixXd, V> && !std::convertible_to<double, V>);
static_assert(std::convertible_to<V, Eigen::Vector3d> && std::convertible_to<V, Eigen::RowVector3d> &&
              std::convertible_to<V, Eigen::Array3d> && !std::convertible_to<V, Eigen::Vector2d> &&
              !std::convertible_to<V, Eigen::Vector3f> && !std::convertible_to<M, Eigen::Vector3d>);
// A map of what has a name, a value of what has none.
static_assert(
    std::same_as<decltype(as_eigen(std::declval<V&>())), Eigen::Map<Eigen::Vector3d>> &&
    std::same_as<decltype(as_eigen(std::declval<const M&>())), Eigen::Map<const Eigen::Matrix3d>> &&
    std::same_as<decltype(as_eigen(std::declval<V>())), Eigen::Vector3d> &&
    std::same_as<decltype(as_eigen(std::declval<const M>())), Eigen::Matrix3d> &&
    std::same_as<decltype(as_eigen(std::declval<std::vector<V>>())), Eigen::Matrix3Xd> &&
    std::same_as<decltype(as_eigen(std::declval<const std::vector<V>&>())), Eigen::Map<const Eigen::Matrix3Xd>>);

TEST_CASE("A vector is taken from every kind of Eigen's expressions", "[core][eigen]") {
    CHECK(given(a) == sum(1, 2, 3));
    CHECK(given(a + 2 * b) == sum(-7, 12, 4));
    CHECK(given(A * a) == sum(14, 32, 53));
    CHECK(given(a.cross(b)) == sum(-14, -12.5, 13));
    CHECK(given(a.transpose()) == sum(1, 2, 3));
    CHECK(given(A.col(1)) == sum(2, 5, 8));
    CHECK(given(A.row(2)) == sum(7, 8, 10));
    CHECK(given(A.diagonal()) == sum(1, 5, 10));
    CHECK(given(Eigen::Vector3d::Unit(2) * 4) == sum(0, 0, 4));
    CHECK(given(a.array() * b.array()) == sum(-4, 10, 1.5));
    CHECK(given(Eigen::Vector3f(1, 2, 0.1F)) == sum(1, 2, 0.1F));
    const double numbers[] = {5, 0, 6, 0, 7};
    CHECK(given(Eigen::Map<const Eigen::Vector3d, 0, Eigen::InnerStride<2>>(numbers)) == sum(5, 6, 7));
    const Eigen::Ref<const Eigen::Vector3d> named(a);
    CHECK(given(named) == sum(1, 2, 3));
    V assigned{};
    assigned = a - b;
    CHECK(assigned == sum(5, -3, 2.5));
    CHECK(assigned + b == sum(1, 2, 3));
    CHECK(from_eigen(a + a) == sum(2, 4, 6));
}

TEST_CASE("A matrix is taken from every kind of Eigen's expressions", "[core][eigen]") {
    const auto same = [](const M& x, const Eigen::Matrix3d& expected) { return as_eigen(x) == expected; };
    CHECK(same(given_matrix(A), A));
    CHECK(same(given_matrix(A.transpose()), A.transpose()));
    CHECK(same(given_matrix(A * A - 2 * A), A * A - 2 * A));
    CHECK(same(given_matrix(a * b.transpose()), a * b.transpose()));
    CHECK(same(given_matrix(A.inverse()), A.inverse()));
    CHECK(same(given_matrix(Eigen::Matrix<double, 3, 3, Eigen::RowMajor>(A)), A));
    CHECK(same(from_eigen(A.transpose()), A.transpose()));
    CHECK(given_matrix(A)(0, 2) == 3);
    CHECK(given_matrix(Eigen::Matrix3d::Identity() * 2)(1, 1) == 2);
}

TEST_CASE("A size that is known at run time only is checked then", "[core][eigen]") {
    const Eigen::MatrixXd many = Eigen::MatrixXd::Random(4, 3);
    CHECK(given(many.row(1)) == sum(many(1, 0), many(1, 1), many(1, 2)));
    CHECK(given_matrix(many.topRows(3))(2, 1) == many(2, 1));
    CHECK_THROWS_AS(given_matrix(many), parameter_error);
    test_support::check_refused<parameter_error>([&] { given(many.col(1)); },
                                                 "matrix of 4 × 1 numbers is given where 3 × 1 are taken");
}

TEST_CASE("firn's vectors and matrices become Eigen's", "[core][eigen]") {
    const V x = sum(1, 2, 3);
    const M m = M::rows(1, 2, 3, 4, 5, 6, 7, 8, 10);
    const Eigen::Vector3d column = x;
    const Eigen::RowVector3d row = x;
    const Eigen::Array3d array = x;
    const Eigen::Matrix3d matrix = m;
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> by_rows = m;
    CHECK((column == a && row == a.transpose() && (array == a.array()).all() && matrix == A && by_rows == A));
    CHECK(as_eigen(x).dot(as_eigen(m) * as_eigen(x)) == a.dot(A * a));

    V written = x;
    as_eigen(written) *= 2;
    as_eigen(written)[0] = -1;
    CHECK(written == sum(-1, 4, 6));
    const auto kept = as_eigen(x + x);  // outlives the temporary
    const auto of_matrix = as_eigen(m * m);
    CHECK((kept == 2 * a && of_matrix == A * A));
}

TEST_CASE("Functions of Eigen's vectors are called with firn's, and return theirs", "[core][eigen]") {
    const std::function<V(const V&, double)> callback = [](const Eigen::Vector3d& at, double t) -> Eigen::Vector3d {
        return at * t;
    };
    CHECK(callback(sum(1, 2, 3), 2) == sum(2, 4, 6));
    const auto deducing = []<class S, int D>(const Eigen::Matrix<S, D, 1>& at) -> Eigen::Matrix<S, D, 1> {
        return at.cwiseProduct(at);
    };
    CHECK(detail::call(deducing, sum(1, 2, 3)) == sum(1, 4, 9));
    CHECK(detail::call(deducing, Vec<float, 2>{3.0F, 4.0F}) == Vec<float, 2>{9.0F, 16.0F});
    const auto lanes = detail::call(deducing, Vec<native_pack<float>, 2>{native_pack<float>(3), native_pack<float>(4)});
    CHECK(lane_value(lanes[1], 3) == 16);
    const auto mixed = []<int D>(double scale, const Eigen::Matrix<double, D, D>& F,
                                 const Eigen::Matrix<double, D, 1>& at) { return scale * (F * at).sum(); };
    CHECK(detail::call(mixed, 2.0, given_matrix(A), sum(1, 2, 3)) == 2 * (A * a).sum());
}

TEST_CASE("Many vectors, matrices or numbers are one matrix of Eigen's", "[core][eigen]") {
    std::vector<V> points{sum(1, 2, 3), sum(4, 5, 6)};
    CHECK(as_eigen(points).col(1) == Eigen::Vector3d(4, 5, 6));
    as_eigen(points).row(0).setConstant(9);
    CHECK((points[0] == sum(9, 2, 3) && points[1] == sum(9, 5, 6)));
    CHECK(as_eigen(std::as_const(points)).rowwise().sum() == Eigen::Vector3d(18, 7, 9));
    CHECK(as_eigen(std::span(points).last(1)) == Eigen::Vector3d(9, 5, 6));
    const auto kept = as_eigen(std::vector<V>(3, sum(7, 8, 9)));  // outlives the vector
    CHECK((kept.cols() == 3 && kept.col(2) == Eigen::Vector3d(7, 8, 9)));
    CHECK(as_eigen(std::vector<V>{}).size() == 0);

    aligned_vector<float> masses;
    masses.assign(3, 0.5F);
    CHECK((as_eigen(masses).rows() == 3 && as_eigen(masses).sum() == 1.5F));
    const std::vector<M> matrices{given_matrix(A), given_matrix(A.transpose())};
    CHECK((as_eigen(matrices).rows() == 9 && as_eigen(matrices).col(1).reshaped(3, 3) == A.transpose()));
    const std::vector<std::uint32_t> ids{4, 2};
    CHECK(as_eigen(ids)[1] == 2U);
}

TEST_CASE("A vector of two numbers in space has none along the third axis", "[core][tensor]") {
    const V x{1.0, 2.0};
    CHECK(x == sum(1, 2, 0));
    const V numbers{{1, 2, 3}};
    CHECK(numbers == sum(1, 2, 3));
}

}  // namespace eigen_tests
