#include <firn/firn.hpp>

#include <string>

std::string version_in_other_unit() {
    static_assert(FIRN_VERSION == 10000 * firn::version_major + 100 * firn::version_minor + firn::version_patch);
    return std::to_string(firn::version_major) + "." + std::to_string(firn::version_minor) + "." +
           std::to_string(firn::version_patch);
}
