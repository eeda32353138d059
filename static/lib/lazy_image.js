/** An image of fixed size that is asked for only once it is wanted, and not any more once it is gone. */

import { Icon } from "./icon.js";
import { html, useEffect, useLayoutEffect, useRef, useState } from "./view.js";

/**
 * It fills whatever holds it, which gives it its size.
 * @param {object} props
 * @param {string} props.address
 * @param {boolean} props.wanted whether it may be asked for now; what was asked for stays
 * @param {string} [props.label] what a screen reader says; absent: decoration of something that is named
 * @param {() => Promise<string>} props.reason why it cannot be shown, asked only if it cannot
 */
export function LazyImage({ address, wanted, label = "", reason }) {
  const image = useRef(/** @type {HTMLImageElement | null} */ (null));
  const [broken, setBroken] = useState(/** @type {{address: string, reason: string} | null} */ (null));

  useLayoutEffect(() => {
    const element = image.current;
    if (element === null || element.dataset.address === address) return;
    if (wanted) {
      element.dataset.address = address;
      element.src = address;
    } else {
      // What it showed was another image.
      delete element.dataset.address;
      element.removeAttribute("src");
    }
  }, [address, wanted, broken]);

  useEffect(() => {
    const element = image.current;
    // A request that nobody waits for any more would hold up those behind it.
    return () => (element !== null && !element.complete ? element.removeAttribute("src") : undefined);
  }, []);

  const failed = async () => {
    const asked = image.current?.dataset.address;
    if (asked !== address) return;
    setBroken({ address, reason: "This image cannot be shown." });
    const why = await reason();
    setBroken((now) => (now?.address === address ? { address, reason: why } : now));
  };

  const unusable = broken !== null && broken.address === address;
  return html`<img
      ref=${image} class="lazy-image" alt=${label} decoding="async" fetchpriority="low" draggable=${false}
      hidden=${unusable} onError=${failed}
    />
    ${unusable && html`<span class="lazy-image broken" title=${broken.reason}><${Icon} name="image" size=${18} /></span>`}`;
}
