/// \file Conversions between firn's small vectors and matrices and Eigen's. Include this header to use them.
///
/// From Eigen: every function that takes a `Vec<S, D>` or `Mat<S, D>` also takes Eigen's expressions of that size and
/// evaluates them at once. A vector may be a row. A size that is known only at run time is checked then.
///
/// To Eigen: `Eigen::Vector3d x = vec;` copies. as_eigen(vec) returns a map of the numbers, which is valid while vec
/// lives; for a temporary it returns a copy. A callback may take and return Eigen's types.
///
/// A material, an acceleration field or a shape may be written in Eigen's types, for all scalars of firn (lanes, dual
/// numbers, the scalar that records WGSL). Functions of Eigen's that branch on values do not compile for these.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <Eigen/Core>

#include <ranges>
#include <type_traits>

namespace firn {

namespace detail {

template <class E>
void as_dense(const Eigen::DenseBase<E>&);

template <class E>
concept eigen_dense = requires(const E& e) { detail::as_dense(e); };

template <class E>
concept eigen_owning = eigen_dense<E> && std::derived_from<E, Eigen::PlainObjectBase<E>>;

/// What all dense types of Eigen's have in common.
template <class E>
struct foreign_of_eigen {
    static constexpr bool owns = eigen_owning<E>;

    template <int Rows, int Columns>
    static constexpr bool holds = [] {
        const auto may_be = [](int by_type, int wanted) { return by_type == wanted || by_type == Eigen::Dynamic; };
        constexpr int rows = E::RowsAtCompileTime, columns = E::ColsAtCompileTime;
        if (Columns > 1) return may_be(rows, Rows) && may_be(columns, Columns);
        return (columns == 1 && may_be(rows, Rows)) || (rows == 1 && may_be(columns, Rows));
    }();

    /// Evaluates an expression into Rows × Columns numbers.
    /// \throws parameter_error  if a size that is known only at run time differs
    template <class S, int Rows, int Columns>
    FIRN_INLINE static void read(const E& from, S* numbers) {
        using T = typename E::Scalar;
        constexpr bool fits = !std::floating_point<S> || requires(const T& number) { S{number}; };
        static_assert(
            fits,
            "firn: the numbers of this Eigen expression do not fit into firn's scalar. Say that they are to be "
            "rounded: .cast<float>().");
        constexpr bool is_row = Columns == 1 && Rows > 1 && E::RowsAtCompileTime == 1;
        constexpr int rows = is_row ? 1 : Rows, columns = is_row ? Rows : Columns;
        if constexpr (E::SizeAtCompileTime == Eigen::Dynamic)
            if (from.rows() != rows || from.cols() != columns)
                throw parameter_error(sentence("Eigen's matrix of ", from.rows(), " × ", from.cols(),
                                               " numbers is given where ", rows, " × ", columns, " are taken."));
        using To = Eigen::Matrix<S, rows, columns, is_row ? Eigen::RowMajor : Eigen::ColMajor>;
        if constexpr (fits) Eigen::Map<To>(numbers).noalias() = from.derived().matrix().template cast<S>();
    }
};

template <class S, int Rows, int Columns>
struct own_type {};
template <class S, int D>
struct own_type<S, D, D> {
    using type = Mat<S, D>;
};
template <class S, int D>
struct own_type<S, D, 1> {
    using type = Vec<S, D>;
};
template <class S, int D>
struct own_type<S, 1, D> {
    using type = Vec<S, D>;
};
template <class S>
struct own_type<S, 1, 1> {
    using type = Vec<S, 1>;
};
template <class E>
using own_type_t = typename own_type<typename E::Scalar, E::RowsAtCompileTime, E::ColsAtCompileTime>::type;

/// An Eigen::Matrix or Eigen::Array of the size of a vector or a square matrix.
template <class E>
concept eigen_small = eigen_owning<E> && requires { typename own_type_t<E>; };

}  // namespace detail

/// Eigen's dense types, expressions included.
template <detail::eigen_dense E>
struct foreign<E> : detail::foreign_of_eigen<E> {};

/// Eigen's matrices and arrays of the size of a vector or a square matrix.
template <detail::eigen_dense E>
    requires detail::eigen_small<E>
struct foreign<E> : detail::foreign_of_eigen<E> {
    using own = detail::own_type_t<E>;  ///< firn's type for it: a Vec or a Mat

    /// Returns an E of these numbers, which are ordered column by column.
    FIRN_INLINE static E made(const typename E::Scalar* numbers) {
        constexpr int rows = E::RowsAtCompileTime, columns = E::ColsAtCompileTime;
        constexpr int order = rows == 1 && columns != 1 ? Eigen::RowMajor : Eigen::ColMajor;
        using From = std::conditional_t<std::derived_from<E, Eigen::MatrixBase<E>>,
                                        Eigen::Matrix<typename E::Scalar, rows, columns, order>,
                                        Eigen::Array<typename E::Scalar, rows, columns, order>>;
        return Eigen::Map<const From>(numbers);
    }
};

/// Declares Eigen's types for a Vec and a Mat. It is never called. \see foreign.hpp
/// @{
template <class S, int D>
Eigen::Matrix<S, D, 1> counterpart_of(const Vec<S, D>&, const void*);
template <class S, int D>
Eigen::Matrix<S, D, D> counterpart_of(const Mat<S, D>&, const void*);
/// @}

/// Returns a map of the numbers of a vector or matrix, valid while that lives; for a temporary, a copy.
/// @{
template <class S, int D>
Eigen::Map<Eigen::Matrix<S, D, 1>> as_eigen(Vec<S, D>& a) {
    return Eigen::Map<Eigen::Matrix<S, D, 1>>(a.v);
}
template <class S, int D>
Eigen::Map<const Eigen::Matrix<S, D, 1>> as_eigen(const Vec<S, D>& a) {
    return Eigen::Map<const Eigen::Matrix<S, D, 1>>(a.v);
}
template <class S, int D>
Eigen::Matrix<S, D, 1> as_eigen(const Vec<S, D>&& a) {
    return a;
}
template <class S, int D>
Eigen::Map<Eigen::Matrix<S, D, D>> as_eigen(Mat<S, D>& a) {
    return Eigen::Map<Eigen::Matrix<S, D, D>>(a.m);
}
template <class S, int D>
Eigen::Map<const Eigen::Matrix<S, D, D>> as_eigen(const Mat<S, D>& a) {
    return Eigen::Map<const Eigen::Matrix<S, D, D>>(a.m);
}
template <class S, int D>
Eigen::Matrix<S, D, D> as_eigen(const Mat<S, D>&& a) {
    return a;
}

/// @}

/// Evaluates an expression to a Vec or Mat. If its size is known only at run time, write `Vec<double, 3>(a)` instead.
template <class E>
auto from_eigen(const Eigen::DenseBase<E>& a) {
    return detail::own_type_t<E>(a.derived());
}

namespace detail {

/// Eigen's type for many scalars (a row each), vectors (a column each) or matrices (a column each, column by column).
template <class T>
struct eigen_of_many {};
template <class S>
    requires std::is_arithmetic_v<S>
struct eigen_of_many<S> {
    using number = S;
    using type = Eigen::Matrix<S, Eigen::Dynamic, 1>;
};
template <class S, int D>
struct eigen_of_many<Vec<S, D>> {
    using number = S;
    using type = Eigen::Matrix<S, D, Eigen::Dynamic>;
};
template <class S, int D>
struct eigen_of_many<Mat<S, D>> {
    using number = S;
    using type = Eigen::Matrix<S, D * D, Eigen::Dynamic>;
};

template <class R>
concept range_for_eigen = std::ranges::contiguous_range<R> && std::ranges::sized_range<R> &&
                          requires { typename eigen_of_many<std::ranges::range_value_t<R>>::type; };

}  // namespace detail

/// Returns a vector, span or array of numbers, Vec or Mat as one Eigen matrix. Each Vec is a column. Each Mat is a
/// column, too, with its own columns one after another. Each number is a row.
///
/// The result is a map of the numbers, valid while these live; for a temporary vector it is a copy.
template <detail::range_for_eigen Range>
auto as_eigen(Range&& range) {
    using Of = detail::eigen_of_many<std::ranges::range_value_t<Range>>;
    using All = typename Of::type;
    constexpr bool fixed = std::is_const_v<std::remove_reference_t<std::ranges::range_reference_t<Range>>>;
    using Map = Eigen::Map<std::conditional_t<fixed, const All, All>>;
    using Number = std::conditional_t<fixed, const typename Of::number, typename Of::number>;
    constexpr int rows = All::RowsAtCompileTime;
    const auto count = Eigen::Index(std::ranges::size(range));
    const Map all(reinterpret_cast<Number*>(std::ranges::data(range)), rows < 0 ? count : rows, rows < 0 ? 1 : count);
    if constexpr (std::ranges::borrowed_range<Range>)
        return all;
    else
        return All(all);
}

namespace detail {

/// A scalar of firn's that is not float or double. Eigen also checks this concept for its own expressions while it
/// defines them, so the concept must not evaluate one.
template <class S>
concept scalar_for_eigen = !std::same_as<value_type_t<S>, S>;

template <class S>
struct no_singular_values {
    static_assert(!scalar_for_eigen<S>,
                  "firn: Eigen finds singular values by branching on values, and sixteen particles may disagree. Write "
                  "firn::svd(firn::Mat<S, D>(F)), see firn/math/svd.hpp.");
};
template <class S>
struct no_eigenvalues {
    static_assert(!scalar_for_eigen<S>,
                  "firn: Eigen finds eigenvalues by branching on values, and sixteen particles may disagree. Those of "
                  "FFᵀ are the squares of firn::left_singular(firn::Mat<S, D>(F)), see firn/math/svd.hpp.");
};
template <class S>
struct no_decomposition {
    static_assert(!scalar_for_eigen<S>,
                  "firn: this decomposition of Eigen's branches on values, and sixteen particles may disagree. Write "
                  "F.inverse() * b to solve, or firn::svd(firn::Mat<S, D>(F)), see firn/math/svd.hpp.");
};

template <class S>
struct no_checked_inverse {
    static_assert(
        !scalar_for_eigen<S>,
        "firn: Eigen's checked inverse branches on the determinant, and sixteen particles may disagree. Write "
        "F.inverse(), and firn::select(F.determinant() == S(0), a, b) where it does not exist.");
    template <class... A>
    static void run(const A&...) {}
};

}  // namespace detail

}  // namespace firn

namespace Eigen {

/// Traits of firn's lanes, dual numbers and recorded numbers, with the costs of a float.
template <firn::detail::scalar_for_eigen S>
struct NumTraits<S> : GenericNumTraits<S> {
    using Real = S;        ///< type of the real part
    using NonInteger = S;  ///< type of quotients
    using Nested = S;      ///< how expressions hold a number
    using Literal = S;     ///< type of constants
    /// Eigen's traits of a number, and its costs in operations.
    enum {
        IsComplex = 0,
        IsInteger = 0,
        IsSigned = 1,
        RequireInitialization = !std::is_trivially_default_constructible_v<S>,
        ReadCost = 1,
        AddCost = 1,
        MulCost = 1
    };
};

template <typename MatrixType>
class SelfAdjointEigenSolver;
template <typename MatrixType>
class EigenSolver;

template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC, int Q>
class JacobiSVD<Matrix<S, R, C, O, MR, MC>, Q> : firn::detail::no_singular_values<S> {};
template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC>
class BDCSVD<Matrix<S, R, C, O, MR, MC>> : firn::detail::no_singular_values<S> {};
template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC>
class SelfAdjointEigenSolver<Matrix<S, R, C, O, MR, MC>> : firn::detail::no_eigenvalues<S> {};
template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC>
class EigenSolver<Matrix<S, R, C, O, MR, MC>> : firn::detail::no_eigenvalues<S> {};
template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC>
class PartialPivLU<Matrix<S, R, C, O, MR, MC>> : firn::detail::no_decomposition<S> {};
template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC>
class FullPivLU<Matrix<S, R, C, O, MR, MC>> : firn::detail::no_decomposition<S> {};
template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC>
class HouseholderQR<Matrix<S, R, C, O, MR, MC>> : firn::detail::no_decomposition<S> {};
template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC>
class ColPivHouseholderQR<Matrix<S, R, C, O, MR, MC>> : firn::detail::no_decomposition<S> {};
template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC, int U>
class LLT<Matrix<S, R, C, O, MR, MC>, U> : firn::detail::no_decomposition<S> {};
template <firn::detail::scalar_for_eigen S, int R, int C, int O, int MR, int MC, int U>
class LDLT<Matrix<S, R, C, O, MR, MC>, U> : firn::detail::no_decomposition<S> {};

namespace internal {

/// Arrays of lanes have the alignment of lanes. Eigen's own alignment is at most a register of the target, but a pack
/// may be wider.
template <firn::detail::scalar_for_eigen S, int Size>
    requires(Size != Dynamic)
struct compute_default_alignment<S, Size> {
    enum { value = 0 };
};

template <typename MatrixType, typename ResultType, int Size>
struct compute_inverse_and_det_with_check;

template <firn::detail::scalar_for_eigen S, int O, int MR, int MC, typename Result>
struct compute_inverse_and_det_with_check<Matrix<S, 2, 2, O, MR, MC>, Result, 2> : firn::detail::no_checked_inverse<S> {
};
template <firn::detail::scalar_for_eigen S, int O, int MR, int MC, typename Result>
struct compute_inverse_and_det_with_check<Matrix<S, 3, 3, O, MR, MC>, Result, 3> : firn::detail::no_checked_inverse<S> {
};

}  // namespace internal

}  // namespace Eigen
