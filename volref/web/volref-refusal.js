// Errors of these modules are one sentence: rule, what was got, cure.

/**
 * @param {string} rule  what must be, with its name
 * @param {unknown} got
 * @param {string} cure
 * @returns {never}
 */
export function refuse(rule, got, cure) {
  throw new Error(`${rule}, got ${got}; ${cure}`);
}
