/* Computes cases from a file with every instruction set that this processor has, and compares every bit with the file's results.
 *
 * The file, little endian: "TANDEM1\n", number of cases (u64); of each: kind (u32), number of fields (u32), of each field its bytes
 * (u64 length, then the bytes). To add a kind: a function in a file of its own, a line in `checks`, its writer in arm.py.
 *
 * SPDX-License-Identifier: Apache-2.0
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cases.h"
#include "tandem.h"

static check_fn *const checks[] = {check_points, check_records, check_remap, check_match};

int same_bytes(const void *result, uint64_t size, const struct field *expected)
{
    return expected->size == size && memcmp(result, expected->bytes, (size_t)size) == 0;
}

static void read_exactly(FILE *file, void *to, uint64_t size)
{
    if (size != 0 && fread(to, 1, (size_t)size, file) != size) {
        fputs("error: the file of cases is cut off\n", stderr);
        exit(2);
    }
}

static void read_case(FILE *file, struct one_case *into)
{
    read_exactly(file, &into->kind, sizeof into->kind);
    read_exactly(file, &into->fields, sizeof into->fields);
    if (into->kind >= sizeof checks / sizeof checks[0] || into->fields > MOST_FIELDS) {
        fputs("error: the file of cases has a kind that this program does not know\n", stderr);
        exit(2);
    }
    for (uint32_t i = 0; i < into->fields; i++) {
        struct field *field = &into->field[i];
        read_exactly(file, &field->size, sizeof field->size);
        field->bytes = malloc(field->size != 0 ? (size_t)field->size : 1);
        if (field->bytes == NULL) {
            fputs("error: no memory\n", stderr);
            exit(2);
        }
        read_exactly(file, field->bytes, field->size);
    }
}

static int check_all(FILE *file, int32_t isa)
{
    char magic[8];
    uint64_t count = 0;
    int wrong = 0;
    rewind(file);
    read_exactly(file, magic, sizeof magic);
    if (memcmp(magic, "TANDEM1\n", sizeof magic) != 0) {
        fputs("error: this is no file of cases\n", stderr);
        exit(2);
    }
    read_exactly(file, &count, sizeof count);
    for (uint64_t i = 0; i < count; i++) {
        struct one_case asked;
        read_case(file, &asked);
        const int differs = checks[asked.kind](isa, &asked);
        if (differs >= 0) {
            printf("%s: case %d of kind %d: field %d differs\n", tandem_isa_name(isa), (int)i, (int)asked.kind, differs);
            wrong++;
        }
        for (uint32_t field = 0; field < asked.fields; field++) {
            free(asked.field[field].bytes);
        }
    }
    printf("%s: %d of %d cases have the same bits\n", tandem_isa_name(isa), (int)count - wrong, (int)count);
    return wrong;
}

int main(int argc, char **argv)
{
    FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    int wrong = 0;
    if (file == NULL) {
        fputs("usage: check FILE\n", stderr);
        return 2;
    }
    for (int32_t isa = 0; isa < TANDEM_ISA_COUNT; isa++) {
        if (tandem_isa_state(isa) == TANDEM_USABLE) {
            wrong += check_all(file, isa);
        }
    }
    fclose(file);
    return wrong != 0;
}
