/// \file Conversions between firn's small vectors and matrices and those of Eigen. Include this header to use these
/// conversions.
///
/// From Eigen: every function that takes a `Vec<S, D>` or `Mat<S, D>` also takes an Eigen expression of the same size,
/// and evaluates this expression at once. For a Vec, the expression may be a row vector. If the size of the expression
/// is known only at run time, this size is checked, and parameter_error is thrown if the size differs from that of the
/// Vec or Mat.
///
/// To Eigen: `Eigen::Vector3d x = vec;` copies. as_eigen(vec) returns an Eigen::Map onto the components of vec, and the
/// map is valid while vec lives; if vec is a temporary, as_eigen(vec) returns a copy. A function that you pass to firn
/// may take and return Eigen's types.
///
/// A material, an acceleration field or a shape may be written in Eigen's types, for all scalars of firn: float,
/// double, packs, dual numbers, and the scalar that records a GPU program. With packs, dual numbers and the recording
/// scalar, Eigen's functions that branch on values (e.g. its decompositions) do not compile.
#pragma once

#include <firn/core/requirements.hpp>

#include <firn/core/error.hpp>
#include <firn/core/tensor.hpp>

#include <Eigen/Core>

#include <ranges>
#include <type_traits>

namespace firn::inline FIRN_BUILD {

namespace detail {

template <class E>
void as_dense(const Eigen::DenseBase<E>&);

template <class E>
concept eigen_dense = requires(const E& e) { detail::as_dense(e); };

template <class E>
concept eigen_owning = eigen_dense<E> && std::derived_from<E, Eigen::PlainObjectBase<E>>;

/// Members of `foreign` (the conversions from another library, see foreign.hpp) that all dense types of Eigen share.
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

    /// Whether numbers of the expression can become numbers of type S. What floating-point numbers would be rounded
    /// from is refused by read(), in a sentence.
    template <class S>
    static constexpr bool gives = std::floating_point<S> || std::constructible_from<S, typename E::Scalar>;

    /// Evaluates the expression `from` and writes its Rows × Columns elements to `numbers`, column by column.
    /// \throws parameter_error  if the size of the expression is known only at run time, and is not Rows × Columns
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

/// An Eigen::Matrix or Eigen::Array that has the fixed size of a Vec or a Mat.
template <class E>
concept eigen_small = eigen_owning<E> && requires { typename own_type_t<E>; };

}  // namespace detail

/// The conversion from Eigen's dense types, including expressions, to firn's types. \see foreign.hpp
template <detail::eigen_dense E>
struct foreign<E> : detail::foreign_of_eigen<E> {};

/// The conversions from and to those matrices and arrays of Eigen that have the fixed size of a Vec or a Mat. \see
/// foreign.hpp
template <detail::eigen_dense E>
    requires detail::eigen_small<E>
struct foreign<E> : detail::foreign_of_eigen<E> {
    using own = detail::own_type_t<E>;  ///< firn's type of the same size: a Vec or a Mat

    /// Returns an Eigen matrix or array whose elements are read from `numbers`, column by column.
    FIRN_INLINE static E made(const typename E::Scalar* numbers) {
        constexpr int rows = E::RowsAtCompileTime, columns = E::ColsAtCompileTime;
        constexpr int order = rows == 1 && columns != 1 ? Eigen::RowMajor : Eigen::ColMajor;
        using From = std::conditional_t<std::derived_from<E, Eigen::MatrixBase<E>>,
                                        Eigen::Matrix<typename E::Scalar, rows, columns, order>,
                                        Eigen::Array<typename E::Scalar, rows, columns, order>>;
        return Eigen::Map<const From>(numbers);
    }
};

/// The return type of this function is the Eigen type that corresponds to a Vec or a Mat. The function is never called.
/// \see foreign.hpp
/// @{
template <class S, int D>
Eigen::Matrix<S, D, 1> counterpart_of(const Vec<S, D>&, const void*);
template <class S, int D>
Eigen::Matrix<S, D, D> counterpart_of(const Mat<S, D>&, const void*);
/// @}

/// Returns an Eigen::Map onto the elements of a Vec or Mat. The map is valid while the Vec or Mat lives. For a
/// temporary Vec or Mat, returns a copy.
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

/// Evaluates an Eigen expression of fixed size and returns the result as a Vec or Mat. For an expression whose size is
/// known only at run time, write `Vec<double, 3>(a)` instead.
template <class E>
auto from_eigen(const Eigen::DenseBase<E>& a) {
    return detail::own_type_t<E>(a.derived());
}

namespace detail {

/// `type` is the Eigen matrix for a list of values of type T, and `number` is the type of this matrix's elements. For a
/// list of numbers, the matrix has one column, with one row per number. For a list of Vecs, the matrix has one column
/// per Vec. For a list of Mats, it has one column per Mat, which holds the elements of this Mat column by column.
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

/// Returns all elements of a std::vector, span or array as one Eigen matrix. For a list of numbers, the matrix has one
/// column, with one row per number. For a list of Vecs, the matrix has one column per Vec. For a list of Mats, it has
/// one column per Mat, which holds the elements of this Mat column by column.
///
/// The result is an Eigen::Map, valid while the elements live. For a temporary std::vector the result is a copy.
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

/// A scalar of firn that is not float or double. The concept must not contain an operation with S, because Eigen also
/// tests it for Eigen's own expression types, before these types are complete.
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

}  // namespace firn::inline FIRN_BUILD

namespace Eigen {

/// Eigen's traits for firn's packs, dual numbers and recorded numbers. The costs of operations are given as for float.
template <firn::detail::scalar_for_eigen S>
struct NumTraits<S> : GenericNumTraits<S> {
    using Real = S;        ///< type of the real part of a number
    using NonInteger = S;  ///< type of quotients
    using Nested = S;      ///< type of a number that an expression stores
    using Literal = S;     ///< type of constants
    /// Properties of a number: it is signed, not complex and not an integer. It needs a constructor unless its default
    /// constructor is trivial. Its operations cost as much as those of a float.
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

/// Leaves the alignment of Eigen's fixed-size arrays of S to the compiler, which aligns an array like S. The alignment
/// that Eigen would choose is at most the size of one SIMD register. That is too small if S is a pack that is wider
/// than one register.
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
