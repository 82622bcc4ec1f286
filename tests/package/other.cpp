#include <firn/firn.hpp>

#include <string>

std::string version_in_other_unit() {
    return std::to_string(firn::version_major) + "." + std::to_string(firn::version_minor) + "." +
           std::to_string(firn::version_patch);
}
