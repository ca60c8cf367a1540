#include "sim/scene/fabric_schema.h"
bool fabric_print_list(FILE *out, bool json, Error *error) {
    (void)out;
    (void)json;
    (void)error;
    return true;
}
bool fabric_print(const char *name, FILE *out, bool json, Error *error) {
    (void)name;
    (void)out;
    (void)json;
    (void)error;
    return true;
}
