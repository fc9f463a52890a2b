// Reads JSON Schema (2020-12, as schemars writes it) into the few shapes that the controls know. No DOM.

export const equal = (a, b) => {
  if (a === b) return true;
  if (typeof a !== 'object' || typeof b !== 'object' || a === null || b === null) return false;
  const keys = Object.keys(a);
  return Array.isArray(a) === Array.isArray(b) && keys.length === Object.keys(b).length
    && keys.every((key) => key in b && equal(a[key], b[key]));
};

const isNull = (schema) => schema.type === 'null' || ('const' in schema && schema.const === null);

function target(root, reference) {
  if (!reference.startsWith('#')) return {};
  return reference.slice(1).split('/').filter(Boolean)
    .map((part) => decodeURIComponent(part).replaceAll('~1', '/').replaceAll('~0', '~'))
    .reduce((at, part) => at?.[part], root) ?? {};
}

/** Follows $ref, single allOf and "or null"; what is said beside a reference wins over what it points at. */
export function resolve(schema, root, depth = 0) {
  if (schema === true || schema === undefined || depth > 16) return {};
  const { $ref: reference, allOf, anyOf, oneOf, ...own } = schema;
  const inner = (other) => ({ ...resolve(other, root, depth + 1), ...own });
  if (reference) return inner(target(root, reference));
  if (allOf) return allOf.reduce((all, one) => ({ ...all, ...resolve(one, root, depth + 1) }), { ...own, ...choices(anyOf, oneOf) });
  const alternatives = anyOf ?? oneOf;
  if (alternatives) {
    const others = alternatives.map((one) => resolve(one, root, depth + 1)).filter((one) => !isNull(one));
    const nullable = others.length < alternatives.length || others.some((one) => one.nullable);
    if (others.length === 1) return { ...others[0], ...own, nullable };
    const options = others.flatMap(constants);
    if (options.every(Boolean)) return { ...own, type: 'string', options, nullable };
    return { ...own, variants: others, nullable };
  }
  if (Array.isArray(own.type)) {
    const types = own.type.filter((type) => type !== 'null');
    return { ...own, type: types.length === 1 ? types[0] : undefined, nullable: types.length < own.type.length };
  }
  return own;
}

const choices = (anyOf, oneOf) => ({ ...(anyOf && { anyOf }), ...(oneOf && { oneOf }) });

/** The fixed values a schema allows, as `{value, description}`; `[undefined]` where it allows others. */
function constants(schema) {
  if ('const' in schema) return [{ value: schema.const, description: schema.description }];
  if (schema.options) return schema.options;
  if (Array.isArray(schema.enum)) return schema.enum.map((value) => ({ value, description: schema.description }));
  return [undefined];
}

/** Which control shows a resolved schema. */
export function kindOf(schema, root) {
  if (schema.options || Array.isArray(schema.enum)) return 'choice';
  if ('const' in schema) return 'constant';
  if (schema.variants) return 'variants';
  switch (schema.type) {
    case 'number': case 'integer': return 'number';
    case 'boolean': return 'boolean';
    case 'string': return 'string';
    case 'object': return schema.properties ? 'object' : 'json';
    case 'array': return vectorItems(schema, root) ? 'vector' : 'json';
    default: return schema.properties ? 'object' : 'json';
  }
}

/** The schemas of a short array of numbers of fixed length, or null. */
export function vectorItems(schema, root) {
  const fixed = schema.prefixItems
    ?? (schema.minItems === schema.maxItems && schema.minItems <= 16 ? Array(schema.minItems).fill(schema.items) : null);
  if (!fixed || fixed.length === 0 || fixed.length > 16) return null;
  const items = fixed.map((item) => resolve(item, root));
  return items.every((item) => item.type === 'number' || item.type === 'integer') ? items : null;
}

export const optionsOf = (schema) => schema.options
  ?? schema.enum.filter((value) => value !== null).map((value) => ({ value }));

/** A closed range for a slider, or null: a range that says no more than "a number" makes none. */
export function rangeOf(schema) {
  const low = schema.minimum ?? schema.exclusiveMinimum;
  const high = schema.maximum ?? schema.exclusiveMaximum;
  return Number.isFinite(low) && Number.isFinite(high) && high > low && (low >= 0 || high - low < 1e9) ? { low, high } : null;
}

const UNITS = [
  [/_per_(\w+)$/, (unit) => `per ${unit.replaceAll('_', ' ')}`], [/_(mm|cm|ms|s|keV|px)$/, (unit) => unit], [/_deg$/, () => '°'],
  [/_(voxels|pixels|bins|rays)$/, (unit) => unit],
];

/** `step_voxels` -> "Step (voxels)". */
export function words(name) {
  let unit = '';
  let rest = name;
  for (const [pattern, say] of UNITS) {
    const found = pattern.exec(name);
    if (!found) continue;
    unit = ` (${say(found[1])})`;
    rest = name.slice(0, found.index);
    break;
  }
  const text = rest.replaceAll('_', ' ');
  return text.charAt(0).toUpperCase() + text.slice(1) + unit;
}

/** A name for one of several shapes: its title, its tag, or the field that it needs. */
export function variantName(schema) {
  const properties = Object.entries(schema.properties ?? {});
  const tag = properties.find(([, property]) => property && 'const' in property);
  if (tag) return String(tag[1].const);
  if ('const' in schema) return String(schema.const);
  return schema.required?.join(', ') || schema.title || properties[0]?.[0] || schema.type || 'value';
}
