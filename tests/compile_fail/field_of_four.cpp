// A state's matrices have the dimension of space or three dimensions: tables, files and WGSL know no others.
// expect: firn: a matrix in a material's state has the dimension of space, or three dimensions.
#include <firn/firn.hpp>

using namespace firn;

#ifdef FIRN_GOOD
constexpr int rows = 3;
#else
constexpr int rows = 4;
#endif

template <scalar S>
struct Wide : Hencky<S> {
    using scalar_type = S;
    template <class T>
    using with_scalar = Wide<T>;
    template <int D>
    struct state : ElasticState<S, D> {
        Mat<S, rows> memory = Mat<S, rows>::zero();
        static constexpr auto fields() {
            return std::tuple_cat(ElasticState<S, D>::fields(), std::tuple{parameter{"memory", "1", &state::memory}});
        }
    };
};

void run() { static_cast<void>(field_table<float, 2, Wide<float>::state<2>>()); }
